"""What is known of a row's maximum is what looking through the row says, whatever has changed before."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.learners.worlds import agent_of, random_mdp
from tuckerl import QLearning, Sarsa
from tuckerl._jit import kernel
from tuckerl.training.agent_arrays import AgentArrays
from tuckerl.training.greedy_actions import greedy_action, greedy_value
from tuckerl.training.row_maxima import ROW, WORTH_FOLLOWING, RowMaxima, change_value, largest_allowed, maximum
from tuckerl.types import BoolArray, FloatArray

N_STATES, N_ACTIONS = 2, 4
VALUES = st.integers(-3, 3).map(float)  # few, so that there are ties
ROWS = st.lists(VALUES, min_size=N_STATES * N_ACTIONS, max_size=N_STATES * N_ACTIONS)
CHANGES = st.lists(
    st.tuples(st.integers(0, N_STATES - 1), st.integers(0, N_ACTIONS - 1), VALUES, st.booleans()), max_size=40
)
MASKS = st.none() | st.lists(st.integers(1, 2**N_ACTIONS - 1), min_size=N_STATES, max_size=N_STATES).map(
    lambda numbers: [[bool(number >> bit & 1) for bit in range(N_ACTIONS)] for number in numbers]
)


@kernel
def _known(agent: AgentArrays, state: int) -> tuple[float, int, int]:
    largest, first, ties = maximum(agent.maxima, agent, state)
    return largest, first, ties


@kernel
def _change(agent: AgentArrays, state: int, action: int, value: float) -> None:
    change_value(agent, state, action, value)


def knowing(q: FloatArray, mask: BoolArray | None = None, call: int = 1, random_ties: bool = True) -> AgentArrays:
    agent = agent_of(q, action_mask=mask, random_ties=random_ties)
    return agent._replace(maxima=RowMaxima(np.zeros(len(q), dtype=ROW), call))


def looked_up(q: FloatArray, mask: BoolArray | None, state: int) -> tuple[float, int, int]:
    row = q[state] if mask is None else np.where(np.asarray(mask)[state], q[state], -np.inf)
    return float(row.max()), int(row.argmax()), int((row == row.max()).sum())


@settings(deadline=None)  # the first example waits for the compiler
@given(ROWS, MASKS, CHANGES)
def test_the_maximum_follows_every_change(rows: list[float], mask: BoolArray | None, changes: list[Any]) -> None:
    q = np.array(rows).reshape(N_STATES, N_ACTIONS)
    agent = knowing(q, mask)
    for state, action, value, is_asked in changes:
        _change(agent, state, action, value)
        assert q[state, action] == value
        if is_asked:  # or the row is not known yet, or several changes come between
            assert _known(agent, state) == looked_up(q, mask, state)
    for state in range(N_STATES):
        assert _known(agent, state) == looked_up(q, mask, state)


@pytest.mark.parametrize("learner", [QLearning, Sarsa])
def test_learners_that_follow_maxima_learn_the_same(learner: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    problem = random_mdp(2, n_states=9, n_actions=WORTH_FOLLOWING)

    def learned() -> FloatArray:
        q: FloatArray = learner(problem, n_agents=2, epsilon=0.2, alpha=0.5, seed=3).learn(60).q
        return q

    followed = learned()
    monkeypatch.setattr("tuckerl.training.learner.KEEP_MAXIMA", set())
    np.testing.assert_array_equal(followed, learned())


def test_what_changed_between_two_calls_is_seen() -> None:
    q = np.array([[1.0, 2.0, 0.0]])
    agent = knowing(q)
    assert greedy_value(agent, 0) == 2.0
    q[0, 2] = 5.0
    again = agent._replace(maxima=agent.maxima._replace(call=2))
    assert (greedy_value(again, 0), greedy_action(again, 0)) == (5.0, 2)


@pytest.mark.parametrize("mask", [None, [[True, False, True, True]]])
def test_a_promise_that_is_broken_reads_within_the_row(mask: BoolArray | None) -> None:
    q = np.ones((1, 4))
    agent = knowing(q, mask)
    assert greedy_value(agent, 0) == 1.0
    q[:] = [[0.0, 1.0, 2.0, 3.0]]  # by other ways than change_value
    assert all(0 <= greedy_action(agent, 0) < 4 for _ in range(50))


def test_an_action_that_may_not_be_taken_is_never_the_largest() -> None:
    q, mask = np.array([[0.0, -np.inf, -np.inf]]), np.array([[False, True, True]])
    largest, _, first, ties = largest_allowed(q, mask, 0)
    assert (largest, first, ties) == (-np.inf, 1, 2)
