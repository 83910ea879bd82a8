"""What a learner will need of memory, part by part, before any of it is allocated.

Sizes: N agents, S states, A actions, E episodes of a window. Each part is counted in full, though memory that is never
touched costs nothing: only the tables of a window, which grow with the episodes, are counted by the rows that acting
can touch, as long as the whole of their address space could be had at all.
"""

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from tuckerl.generalization.log_window import LogWindow
from tuckerl.generalization.tensor_step import TensorStep
from tuckerl.memory import Part, available_memory
from tuckerl.problems.problem import Problem
from tuckerl.training.agent_arrays import trajectory_length
from tuckerl.training.declared_state import Declaration, DeclaredArray
from tuckerl.training.row_maxima import maxima_bytes

_FLOAT = 8
_PER_AGENT = 8192  # streams, records and what Python keeps of an agent; measured with a learner of 10,000 agents

FEWER_STATES = "use fewer or coarser bins (see tuckerl.quantile_edges), or a smaller problem"
FEWER_AGENTS = "use fewer agents"


def learner_parts(
    problem: Problem, n_agents: int, tensor_step: TensorStep | None, declarations: Sequence[Declaration]
) -> list[Part]:
    """Return what a new learner will need, until the end of its first window."""
    n_states, n_actions = problem.n_states, problem.n_actions
    table = n_agents * n_states * n_actions * _FLOAT
    advice = FEWER_STATES if n_states * n_actions > n_agents else FEWER_AGENTS
    n_worlds = 1 if problem.shares_world else n_agents
    n_kept = trajectory_length(problem.max_episode_steps)
    parts = [
        Part("Q-tables", table, advice),
        Part("trajectories", n_agents * 2 * n_kept * _FLOAT, f"{FEWER_AGENTS}, or set max_episode_steps"),
        Part("what is known of rows", n_agents * maxima_bytes(n_states, n_actions), advice),
        Part("what is kept to undo an episode", n_agents * _undo_bytes(problem, declarations), advice),
        Part("agents", n_agents * (_PER_AGENT + n_actions * _FLOAT), FEWER_AGENTS),
        Part("worlds", n_worlds * problem.world_bytes, advice),
        Part("copies of the environment", (n_worlds - 1) * problem.copy_bytes, FEWER_AGENTS),
        *(Part(f"{one.name!r}", n_agents * declared_bytes(one, n_states, n_actions), advice) for one in declarations),
    ]
    if tensor_step is not None:
        parts += _window_parts(problem, n_agents, tensor_step)
    return parts


def _undo_bytes(problem: Problem, declarations: Sequence[Declaration]) -> int:
    """Return the bytes of one agent's marks and rows, if one call of a kernel changed all that it has by states."""
    n_states, n_actions = problem.n_states, problem.n_actions
    by_state = [one for one in declarations if isinstance(one, DeclaredArray) and one.is_by_state]
    declared = sum(declared_bytes(one, n_states, n_actions) for one in by_state)
    return n_states * (2 + n_actions) * _FLOAT + declared


def _window_parts(problem: Problem, n_agents: int, step: TensorStep) -> Iterator[Part]:
    """Yield the log of changed rows, and what is made of it: a tensor, or what says who changed which entry."""
    places = LogWindow(step, n_agents)
    if places.length == 0:
        return
    n_states, n_actions = problem.n_states, problem.n_actions
    steps = (problem.max_episode_steps or n_states) + 1
    advice = "use a smaller `every` of TensorStep, fewer agents, or coarser bins"
    row = n_agents * places.n_places * (n_actions + 1) * _FLOAT
    reserved = row * n_states
    log = reserved if reserved > available_memory() else row * min(n_states, steps)
    yield Part("changes of a window", log, advice)
    rows = min(n_states, n_agents * places.length * steps)
    table = n_agents * n_actions * rows * _FLOAT
    if step.needs_decomposition:
        yield Part("tensors of a window and of the one before", 2 * step.every * table, advice)
    else:
        yield Part("rows of a window, before and after, their changes and shares", 4 * table, advice)


def declared_bytes(declaration: Declaration, n_states: int, n_actions: int) -> int:
    """Return the bytes of what one agent keeps under a declaration.

    A record is measured for few states and actions, and taken to grow with their numbers and their product.
    """
    if isinstance(declaration, DeclaredArray):
        sizes = {"states": n_states, "actions": n_actions}
        shape = (sizes[size] if isinstance(size, str) else size for size in declaration.shape)
        return math.prod(shape) * np.dtype(declaration.dtype).itemsize
    one, more_states, more_actions, both = (
        _record_bytes(declaration.create_record(*sizes)) for sizes in ((1, 1), (2, 1), (1, 2), (2, 2))
    )
    by_state, by_action, by_pair = more_states - one, more_actions - one, both - more_states - more_actions + one
    states, actions = n_states - 1, n_actions - 1
    return one + by_state * states + by_action * actions + by_pair * states * actions


def _record_bytes(record: Any) -> int:
    held = record if isinstance(record, tuple) else getattr(record, "__dict__", None) or record.to_arrays()
    held = held.values() if isinstance(held, dict) else held
    return sum(part.nbytes for part in held if isinstance(part, np.ndarray))


def history_parts(n_agents: int, n_episodes: int, n_scheduled: int) -> list[Part]:
    """Return what the record of so many more episodes will need."""
    n_bytes = n_episodes * (2 * n_agents + n_scheduled) * _FLOAT
    return [Part("steps, returns and schedules", n_bytes, "learn fewer episodes, or give steps= instead")]


def evaluation_parts(problem: Problem, n_agents: int, n_episodes: int) -> list[Part]:
    """Return what an evaluation of so many episodes will need: its record, a few resamples of their means, a world."""
    n_bytes = n_episodes * (4 * n_agents + 4) * _FLOAT
    return [
        Part("steps, returns and their resamples", n_bytes, "evaluate fewer episodes"),
        Part("a copy of the environment", problem.copy_bytes, "use a smaller environment"),
    ]
