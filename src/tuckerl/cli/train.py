"""``tuckerl train``: one algorithm learns on one environment, and is kept."""

import re
from pathlib import Path
from typing import Annotated

import typer

from tuckerl.cli.options import EnvSettings


def train(
    algorithm: Annotated[str, typer.Argument(help="An algorithm; `tuckerl list algorithms` shows them.")],
    env: Annotated[str, typer.Argument(help="Environment: its id, or MODULE:ID to import what registers it.")],
    episodes: Annotated[int | None, typer.Option(help="Episodes of every agent. Default: 1000.")] = None,
    steps: Annotated[
        int | None, typer.Option(help="Instead: steps of the first agent, and its episode's rest.")
    ] = None,
    agents: Annotated[int, typer.Option(help="Agents, each in its own copy of the environment.")] = 1,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="NAME=VALUE",
            help="A parameter, such as alpha=0.2 or 'epsilon=Linear(0.2,0,400)'; may be repeated. "
            "`tuckerl list ALGORITHM` shows an algorithm's.",
        ),
    ] = None,
    env_settings: EnvSettings = None,
    quantile_bins: Annotated[
        str | None, typer.Option(metavar="N[,N...]", help="Bins of a Box by the quantiles of random play.")
    ] = None,
    seed: Annotated[
        int,
        typer.Option(
            help="Decides what the agents and the environment's own generators draw, and bins and greedy episodes; "
            "not what an environment takes from elsewhere, such as the clock."
        ),
    ] = 0,
    out: Annotated[Path | None, typer.Option(help="Folder for the agent. Default: one in results/train.")] = None,
    checkpoint: Annotated[int | None, typer.Option(min=1, help="Save after every so many episodes, too.")] = None,
    evaluate: Annotated[int, typer.Option(min=0, help="Greedy episodes at the end.")] = 100,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on with the folder's agent, to more episodes than it was to learn.")
    ] = False,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the agent in the folder.")] = False,
) -> None:
    """Learn on an environment; write agent.tuckerl, history.parquet and run.json.

    Ctrl-C keeps what is learned, and the same command goes on from there, to the same bits.
    """
    # Imported here, so that --help is quick.
    from tuckerl.cli.compiling import compiling_said
    from tuckerl.cli.settings import parse_numbers, parse_parameters, parse_settings
    from tuckerl.cli.warnings import short_warnings
    from tuckerl.errors import RankWarning
    from tuckerl.reports.learner_text import failure_lines, how_it_plays, training_lines
    from tuckerl.studies.algorithms import check_order
    from tuckerl.studies.training import Training
    from tuckerl.studies.training_config import TrainingConfig

    check_order("train", algorithm, env)
    given, keywords = parse_parameters(settings or ()), parse_settings(env_settings or (), "--env-set")
    bins = None if quantile_bins is None else parse_numbers(quantile_bins, "--quantile-bins")
    bins = bins[0] if bins and len(bins) == 1 else bins
    config = TrainingConfig(algorithm, env, keywords, given, bins, agents, seed, episodes, steps)
    folder = out or Path("results") / "train" / re.sub(r"[^\w.-]+", "-", f"{algorithm}-{env}")
    # Ranks that nobody chose need no words where a window allows fewer.
    with (
        compiling_said(),
        short_warnings(*(() if "ranks" in given else (RankWarning,))),
        Training(config, folder, resume=resume, overwrite=overwrite) as training,
    ):
        if training.is_finished:
            typer.echo(
                f"Nothing to do: {training.agent_file} has learned this already ({training.learner.episodes:,} "
                "episodes). --resume with more goes on, --overwrite begins anew."
            )
            return
        typer.echo(how_it_plays(env, training.learner), err=True)
        training.learn(checkpoint=checkpoint, progress=True)
        result = training.result(evaluate)
        typer.echo("\n".join([*training_lines(result), *failure_lines(training.learner, result.evaluation)]))
    typer.echo(f"Agent: {training.agent_file}")
