"""What a window costs whose tables are shared by visits: by rows that changed and agents, whatever the tables' size.

The peer is the rule as it is written down, in NumPy: each agent's whole table is compared with the one before after
each of ten episodes, and whole tables are mixed; that it would have to keep these tables is not counted. Ours reads the
change logs, in which each row stands about five times for each agent, and mixes the rows that are in them.
"""

import itertools
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from benchmarks.timing import Row, compare
from tuckerl import TensorStep
from tuckerl.generalization.change_log import empty_log, log_shared
from tuckerl.generalization.step import TensorStepState
from tuckerl.training.sharing import share_all

N_ACTIONS, EPISODES = 4, 10
CASES = (  # states, rows that changed, agents
    (10_000, 10, 3),
    (10_000, 100, 3),
    (10_000, 1_000, 3),
    (10_000, 10_000, 3),
    (10_000, 1_000, 10),
    (10_000, 1_000, 30),
    (2_000, 1_000, 3),
    (100_000, 1_000, 3),
)


def closing(n_states: int, n_rows: int, n_agents: int) -> Callable[[], None]:
    """Return what closes a window in which each agent changed about half of so many rows in each episode."""
    rng, initial_q = np.random.default_rng(0), np.broadcast_to(0.0, (n_states, N_ACTIONS))
    state = TensorStepState(
        TensorStep(EPISODES, weights="none", share="visits"), initial_q, n_agents, np.random.SeedSequence(0)
    )
    logs = tuple(empty_log(n_states, N_ACTIONS, EPISODES) for _ in range(n_agents))
    q, rows = np.zeros((n_agents, n_states, N_ACTIONS)), rng.permutation(n_states)[:n_rows]
    for log, table in zip(logs, q, strict=True):
        for _ in range(EPISODES):
            changed = rows[rng.random(n_rows) < 0.5]
            table[changed] = rng.random((changed.size, N_ACTIONS))
            log_shared(log, table, changed)  # as an episode would leave it
    kept = [(log.cursor.copy(), log.end.copy()) for log in logs]
    returns, weights = np.zeros((n_agents, EPISODES)), np.ones(N_ACTIONS)
    declared: tuple[dict[str, Any], ...] = ({},) * n_agents

    def close() -> None:
        for log, (cursor, end) in zip(logs, kept, strict=True):
            log.cursor[:], log.end[:] = cursor, end
        result = state.close_window(weights, logs, returns, q)
        share_all(result, q, (), declared, initial_q)
        state.begin_window(logs, q, result, EPISODES)

    return close


def on_whole_tables(n_states: int, n_agents: int) -> Callable[[], None]:
    """Return what counts and mixes whole tables."""
    tables = np.random.default_rng(0).random((EPISODES + 1, n_agents, n_states, N_ACTIONS))

    def mix() -> None:
        changes = np.zeros(tables.shape[1:], dtype=np.int64)
        for before, after in itertools.pairwise(tables):
            changes += before != after
        total = changes.sum(axis=0)
        shares = np.where(total > 0, changes / np.maximum(total, 1), 1.0 / n_agents)
        tables[-1] = (shares * tables[-1]).sum(axis=0)

    return mix


def rows() -> Iterator[Row]:
    """Time the cases, in seconds for each row that changed and agent."""
    for n_states, n_rows, n_agents in CASES:
        yield compare(
            f"{n_rows:,} of {n_states:,} rows changed, {n_agents} agents",
            "row and agent",
            closing(n_states, n_rows, n_agents),
            "whole tables in NumPy",
            on_whole_tables(n_states, n_agents),
            units=n_rows * n_agents,
        )
