"""What is said of one learner: its name, how it plays, how its training went, how its greedy episodes are."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from tuckerl.errors import ProblemError
from tuckerl.problems.mdp import TabularMDP
from tuckerl.reports.text import counted, typed
from tuckerl.studies.training import TrainingResult
from tuckerl.training.evaluation import Evaluation
from tuckerl.training.learner import Learner
from tuckerl.training.regret import regret
from tuckerl.types import FloatArray


def name_of(learner: Learner) -> str:
    """Return the learner's class and what it learned on."""
    t_version = " with a tensor step" if learner.tensor_step is not None else ""
    source = getattr(learner.problem, "source", None)
    return f"{type(learner).__name__}{t_version}{f' on {source}' if source else ''}"


def how_it_plays(environment: str, learner: Learner) -> str:
    """Return how an environment is played: in compiled code, or stepped in Python."""
    instead = "; --set compiled=false steps the environment instead" if learner.problem.is_compiled else ""
    return f"{environment}: {learner.problem.describe()}{instead}"


def training_lines(result: TrainingResult) -> list[str]:
    """Return how a training went, line by line."""
    speed = "" if math.isnan(result.rate) else f", {result.rate:,.0f} steps a second"
    lines = [f"{counted(result.episodes, 'episode')}, {counted(result.steps, 'step')}{speed}"]
    if result.n_last:
        last = "the last episode" if result.n_last == 1 else f"the last {result.n_last:,} episodes"
        lines.append(f"Mean return of {last} of learning: {typed(result.last_return)}")
        lines += agent_lines(result.agents, result.last_by_agent)
    return lines if result.evaluation is None else [*lines, *evaluation_lines(result.evaluation, result.agents)]


def agent_lines(agents: Sequence[str], means: FloatArray) -> list[str]:
    """Return each agent's mean return on a line; none where they share all rewards, or each has a world of its own."""
    if len(agents) < 2 or np.ptp(means) == 0:
        return []
    return [f"By agent: {by_agent(dict(zip(agents, means.tolist(), strict=True)))}"]


def by_agent(means: Mapping[str, float]) -> str:
    """Return the agents' mean returns in words."""
    return ", ".join(f"{name} {typed(mean)}" for name, mean in means.items())


def regret_lines(learner: Learner) -> list[str]:
    """Return how far what was learned is from optimal, on a line; none where the transitions are not known."""
    if not isinstance(learner.problem, TabularMDP):
        return []
    try:
        found = regret(learner)
    except ProblemError as error:  # without a discount, there need not be one
        return [f"Regret: not known, as {error}"]
    return [
        f"Regret of its greedy policy from the first states (gamma {learner.gamma:g}): {typed(found.regret)}, as it is "
        f"worth {typed(found.reached)}, and the best {typed(found.best)}"
    ]


def evaluation_lines(evaluation: Evaluation, agents: Sequence[str] = ()) -> list[str]:
    """Return what greedy episodes were like, line by line; by agent, too, where `agents` share a world."""
    interval = ""
    if not math.isnan(evaluation.low):
        interval = f", 95 % interval {typed(evaluation.low)} to {typed(evaluation.high)}"
    episodes = counted(len(evaluation.returns), "greedy episode")
    return [
        f"Mean return of {episodes}: {typed(evaluation.mean)}{interval}",
        *agent_lines(agents, evaluation.returns.mean(axis=0)),
        f"Mean steps of them: {typed(float(evaluation.steps.mean()))}",
    ]
