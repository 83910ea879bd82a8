"""What is said of one learner: its name, how it plays, how its training went, how its greedy episodes are."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from tuckerl.errors import ProblemError
from tuckerl.problems.mdp import TabularMDP
from tuckerl.reports.text import counted, typed
from tuckerl.studies.training import TrainingResult, last_returns
from tuckerl.training.evaluation import Evaluation
from tuckerl.training.learner import Learner
from tuckerl.training.policies.epsilon_greedy import EpsilonGreedy
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
    exact = round(found.regret, 8) + 0.0  # the values are known no better, and no minus zero
    return [
        f"Regret of its greedy policy from the first states (gamma {learner.gamma:g}): {typed(exact)}, as it is "
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


def failure_lines(learner: Learner, evaluation: Evaluation | None) -> list[str]:
    """Return, on a line, that greedy episodes look like a failure and what to try; none where they do not.

    They do where all were cut off, or where all ended with the same return and learning's last episodes had more.
    """
    if evaluation is None:
        return []
    last, n, limit = last_returns(learner), len(evaluation.returns), learner.problem.max_episode_steps
    has_less = evaluation.mean < _mean(last)
    all_of_them = "The greedy episode was" if n == 1 else f"All {counted(n, 'greedy episode')} were"
    less = f"than the last {counted(len(last), 'episode')} of learning had ({typed(_mean(last))})"
    if limit is not None and (evaluation.steps >= limit).all():
        found = f"{all_of_them} cut off after {counted(limit, 'step')}"
        circles = f", with less return {less}: without random actions it goes in circles. To try"
        found += circles if has_less else ". If that is not what was wanted, try"
    elif has_less and n > 1 and np.ptp(evaluation.returns) == 0:
        found = (
            f"All {counted(n, 'greedy episode')} ended with the return {typed(evaluation.mean)}, less {less}. To try"
        )
    else:
        return []
    return [f"{found}: {'; '.join(_to_try(learner))}."]


def _mean(returns: FloatArray) -> float:
    return float(returns.mean()) if returns.size else math.nan


def _to_try(learner: Learner) -> list[str]:
    """Return what may help where a greedy policy fails, the likeliest last."""
    tries = [f"more episodes (--episodes {10 * max(learner.episodes, 1)} --resume)"]
    if isinstance(learner.acting_policy, EpsilonGreedy):
        tries.append("more exploration (--set epsilon=0.3)")
    if learner.tensor_step is not None and learner.tensor_step.weights != "none":
        share = "" if learner.n_agents == 1 else " --set share=visits"
        tries.append(f"the learning rate as it is set, without the tensor's weights (--set weights=none{share})")
    return tries
