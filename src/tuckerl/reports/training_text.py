"""What is said of one learner: how it plays, how its training went, what it does when it is greedy."""

import math

from tuckerl.reports.text import counted
from tuckerl.studies.training import Outcome
from tuckerl.training.evaluation import Evaluation
from tuckerl.training.learner import Learner


def how_it_plays(environment: str, learner: Learner) -> str:
    """Return how an environment is played: in compiled code, or stepped in Python."""
    instead = "; --set compiled=false steps the environment instead" if learner.problem.is_compiled else ""
    return f"{environment}: {learner.problem.describe()}{instead}"


def outcome_lines(outcome: Outcome) -> list[str]:
    """Return how a training went, line by line."""
    speed = "" if math.isnan(outcome.rate) else f", {outcome.rate:,.0f} steps a second"
    lines = [f"{counted(outcome.episodes, 'episode')}, {counted(outcome.steps, 'step')}{speed}"]
    if outcome.n_last:
        last = "the last episode" if outcome.n_last == 1 else f"the last {outcome.n_last:,} episodes"
        lines.append(f"Mean return of {last} of learning: {_number(outcome.last_return)}")
    return lines if outcome.evaluation is None else [*lines, *evaluation_lines(outcome.evaluation)]


def evaluation_lines(evaluation: Evaluation) -> list[str]:
    """Return what greedy episodes were like, line by line."""
    interval = ""
    if not math.isnan(evaluation.low):
        interval = f", 95 % interval {_number(evaluation.low)} to {_number(evaluation.high)}"
    episodes = counted(len(evaluation.returns), "greedy episode")
    return [
        f"Mean return of {episodes}: {_number(evaluation.mean)}{interval}",
        f"Mean steps of them: {_number(float(evaluation.steps.mean()))}",
    ]


def _number(value: float) -> str:
    return f"{value:.4g}" if abs(value) < 1000 else f"{value:,.1f}"
