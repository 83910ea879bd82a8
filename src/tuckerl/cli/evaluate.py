"""``tuckerl evaluate``: greedy episodes with a saved agent, apart from learning."""

from pathlib import Path
from typing import Annotated

import typer

from tuckerl.cli.options import EnvSettings


def evaluate(
    file: Annotated[Path, typer.Argument(help="A saved agent, such as agent.tuckerl, or its folder.")],
    episodes: Annotated[int, typer.Option(help="How many.")] = 100,
    seed: Annotated[int | None, typer.Option(help="Decides the episodes. Default: the agent's own.")] = None,
    env: Annotated[
        str | None, typer.Option(help="What it learned on, where the file and run.json beside it do not say.")
    ] = None,
    env_settings: EnvSettings = None,
) -> None:
    """Play greedy episodes with a saved agent; print their mean return with its interval, and its regret.

    The regret is how much less the greedy policy is worth than an optimal one, where the transitions are known.
    """
    # Imported here, so that --help is quick.
    from tuckerl.cli.compiling import compiling_said
    from tuckerl.cli.settings import parse_settings
    from tuckerl.cli.warnings import short_warnings
    from tuckerl.reports.learner_text import evaluation_lines, failure_lines, name_of, regret_lines
    from tuckerl.studies.training import load_learner, names_of_agents
    from tuckerl.studies.training_folder import agent_at

    with compiling_said(), short_warnings():
        learner = load_learner(agent_at(file), env, parse_settings(env_settings or (), "--env-set"))
        evaluation = learner.evaluate(episodes, seed=seed)
        lines = [*evaluation_lines(evaluation, names_of_agents(learner)), *regret_lines(learner)]
        lines += failure_lines(learner, evaluation)
    typer.echo(f"{name_of(learner)}, after {learner.episodes:,} episodes")
    typer.echo("\n".join(lines))
