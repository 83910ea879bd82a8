"""What is in a learner or a tensor, in a few lines of text."""

from typing import Any

import numpy as np

from tuckerl.reports.inspect.content import Inspection
from tuckerl.reports.learner_text import name_of
from tuckerl.reports.text import counted, joined, number, span
from tuckerl.training.learner import Learner

_MOST_ACTIONS = 10


def learner_lines(learner: Learner) -> list[str]:
    """Return what a learner is, on what and how much it learned, and what it holds."""
    problem, step = learner.problem, learner.tensor_step
    limit = problem.max_episode_steps
    lines = [
        name_of(learner),
        f"Problem: {counted(problem.n_states, 'state')}, {counted(problem.n_actions, 'action')}"
        + (f", at most {counted(limit, 'step')} an episode" if limit else ""),
        f"Parameters: {joined(f'{name} {value}' for name, value in learner.parameters.items())}",
    ]
    if step is not None:
        lines.append(
            f"Tensor step: every {counted(step.every, 'episode')}, ranks {tuple(step.ranks)}, weights "
            f"{_name(step.weights)}, share {_name(step.share)}, floor {step.floor:g}"
        )
    steps = int(learner.steps.sum())
    lines.append(
        f"Learned: {counted(learner.episodes, 'episode')}, {counted(learner.n_agents, 'agent')}, "
        f"{counted(steps, 'step')}"
    )
    if learner.diverged_at is not None:
        lines.append(
            f"The values of a table were no longer finite in episode {learner.diverged_at:,}, where learning stopped"
        )
    lines.append(f"Action weights: {_weights(learner)}")
    value = _value_of_start(learner)
    return lines if value is None else [*lines, f"Greedy value of the start (agent 0): {number(value)}"]


def tensor_lines(inspection: Inspection, shape: tuple[int, ...]) -> list[str]:
    """Return a tensor's sizes, and how well its decomposition fits it."""
    kinds = zip(shape, ("state", "action", "episode", "agent"), strict=True)
    lines = [f"Tensor: {joined(counted(size, kind) for size, kind in kinds)}"]
    if inspection.loadings is None:
        return [*lines, "All of it is zero: there is nothing to decompose"]
    return [*lines, f"Decomposition with ranks {inspection.loadings.core.shape}: fit {number(inspection.loadings.fit)}"]


def _name(value: Any) -> str:
    return value if isinstance(value, str) else getattr(value, "__name__", "a function")


def _weights(learner: Learner) -> str:
    weights, names = learner.action_weights, learner.problem.action_names
    if weights.size > _MOST_ACTIONS or np.ptp(weights) == 0:
        return span(weights)
    return joined(f"{name} {number(float(weight))}" for name, weight in zip(names, weights, strict=True))


def _value_of_start(learner: Learner) -> float | None:
    """Return agent 0's largest value of the first state, on average over these; None where that is not known."""
    mask = learner.action_mask
    best = np.where(True if mask is None else mask[0], learner.q[0], -np.inf).max(axis=-1)
    start = learner.problem.start_distribution()
    if start is not None:
        states, probability = start
        return float(best[states] @ probability)
    path = learner.trajectories[0]
    return float(best[path[0]]) if path.size else None
