"""What an algorithm declares is made, shared, saved and restored as it says."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from tests.learners.worlds import random_mdp
from tests.training.test_resume import assert_same
from tuckerl import TensorStep, kernel
from tuckerl.errors import ParameterError
from tuckerl.generalization.change_log import record_change
from tuckerl.generalization.mixtures import share_tables
from tuckerl.generalization.sharing import ShareContext
from tuckerl.rng import below
from tuckerl.saved_arrays import SavedArrays
from tuckerl.training.agent_arrays import AgentArrays, Transition
from tuckerl.training.algorithm import register_algorithm
from tuckerl.training.declared_state import (
    SHARING,
    Declaration,
    DeclaredArray,
    DeclaredRecord,
    Sharing,
    read_state,
    restore_state,
    saved_state,
)
from tuckerl.training.learner import Learner
from tuckerl.training.memory_account import declared_bytes
from tuckerl.training.sharing import share_state
from tuckerl.types import FloatArray, IntArray

INITIAL = np.array([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]])
MIXED = np.array([0.25, 0.75])
SECOND = np.array([0.0, 1.0])


def two(share: Sharing, first: Any, second: Any, **parameters: Any) -> tuple[DeclaredArray, list[Any]]:
    return DeclaredArray("kept", share, **parameters), [np.array(first), np.array(second)]


# Made


def test_arrays_are_made_as_they_are_declared() -> None:
    cases: list[tuple[DeclaredArray, tuple[int, ...], Any, float]] = [
        (DeclaredArray("kept", "none"), (3, 2), np.float64, 0.0),
        (DeclaredArray("kept", "none", ("states",), np.uint32), (3,), np.uint32, 0),
        (DeclaredArray("kept", "none", ("actions", 4), np.int64, initial=7), (2, 4), np.int64, 7),
    ]
    for declaration, shape, dtype, value in cases:
        made = declaration.create(INITIAL)
        assert made.shape == shape
        assert made.dtype == dtype
        assert (made == value).all()
    made = DeclaredArray("kept", "none", initial=None).create(INITIAL)
    np.testing.assert_array_equal(made, INITIAL)
    made[0, 0] = 99.0
    assert INITIAL[0, 0] == 1.0


@pytest.mark.parametrize("share", ["by_column", "", None])
def test_unknown_ways_to_share_are_refused(share: Any) -> None:
    with pytest.raises(ParameterError, match=r"share of 'kept' must be one of by_entry, by_row, .*; got "):
        DeclaredArray("kept", share)


# Shared


def test_by_entry_arrays_are_mixed_as_the_tables_are() -> None:
    declaration, values = two("by_entry", np.full((3, 2), 4.0), np.full((3, 2), 8.0))
    share_state(declaration, values, MIXED, None, INITIAL)
    for value in values:
        assert value.tolist() == [[7.0, 7.0]] * 3
    declaration, values = two("by_entry", np.full((3, 2), 0.1), INITIAL)
    share_state(declaration, values, SECOND, None, INITIAL)
    for value in values:
        np.testing.assert_array_equal(value, INITIAL)


def test_of_arrays_by_state_only_the_rows_that_can_differ_are_shared() -> None:
    declaration, values = two("by_entry", np.zeros((3, 2)), np.full((3, 2), 8.0))
    share_state(declaration, values, MIXED, np.array([0, 2]), INITIAL)
    assert [value[:, 0].tolist() for value in values] == [[6.0, 0.0, 6.0], [6.0, 8.0, 6.0]]
    # An array that is not by state is shared whole.
    declaration, values = two("by_entry", np.zeros(2), np.full(2, 8.0), shape=("actions",))
    share_state(declaration, values, MIXED, np.array([0]), INITIAL)
    assert [value.tolist() for value in values] == [[6.0, 6.0]] * 2


@pytest.mark.parametrize("mixture", [MIXED, np.array([1 / 3, 2 / 3]), np.array([3.0, -2.0]), np.array([-0.5, 1.5])])
@pytest.mark.parametrize("states", [None, np.array([0, 1, 2])])
def test_by_row_arrays_stay_distributions(mixture: FloatArray, states: IntArray | None) -> None:
    rng = np.random.default_rng(0)
    first, second = (rng.dirichlet(np.full(5, 0.3), size=3) for _ in range(2))
    initial = np.zeros((3, 5))
    declaration, values = two("by_row", first, second)
    share_state(declaration, values, mixture, states, initial)
    np.testing.assert_array_equal(values[0], values[1])
    assert (values[0] >= 0).all()
    np.testing.assert_allclose(values[0].sum(axis=1), 1.0, rtol=1e-14)
    if (mixture >= 0).all():
        np.testing.assert_allclose(values[0], mixture[0] * first + mixture[1] * second, rtol=1e-14)


def test_a_copied_distribution_is_the_other_to_the_last_bit() -> None:
    second = np.random.default_rng(1).dirichlet(np.ones(10), size=20)
    assert (second / second.sum(axis=1, keepdims=True) != second).any(), "what would change it"
    declaration, values = two("by_row", np.full((20, 10), 0.1), second)
    share_state(declaration, values, SECOND, None, np.zeros((20, 10)))
    np.testing.assert_array_equal(values[0], second)


OF_ENTRIES = np.array([[[1.0, 0.5], [0.0, 0.75]], [[0.0, 0.5], [1.0, 0.25]]])  # of the rows of two states
STATES = np.array([2, 0])


def test_by_entry_tables_are_mixed_entry_by_entry_as_the_q_tables_are() -> None:
    first, second = np.arange(6.0).reshape(3, 2), 10 * np.arange(6.0).reshape(3, 2)
    q = np.array([first, second])
    share_tables(q, OF_ENTRIES, STATES)
    declaration, values = two("by_entry", first, second)
    share_state(declaration, values, OF_ENTRIES, STATES, INITIAL)
    expected = [[0.0, 0.75 * 1 + 0.25 * 10], [2.0, 3.0], [4.0, 27.5]]
    for value, table, own in zip(values, q, (3.0, 30.0), strict=True):
        expected[1] = [own * 2 / 3, own]  # a state that is not among them
        expected[0][0] = 0.0
        np.testing.assert_array_equal(value, table)
        np.testing.assert_array_equal(value, expected)


def test_other_arrays_are_mixed_by_the_mean_weights_of_a_row_or_of_all() -> None:
    # The means of the first agent's weights: 0.75 in the row of state 2, 0.375 in that of state 0, 0.5625 in all.
    declaration, values = two("by_entry", [0.0, 0.0, 0.0], [8.0, 8.0, 8.0], shape=("states",))
    share_state(declaration, values, OF_ENTRIES, STATES, INITIAL)
    assert [value.tolist() for value in values] == [[5.0, 0.0, 2.0], [5.0, 8.0, 2.0]]
    declaration, values = two("by_entry", [0.0, 16.0], [16.0, 0.0], shape=("actions",))
    share_state(declaration, values, OF_ENTRIES, STATES, INITIAL)
    assert [value.tolist() for value in values] == [[7.0, 9.0]] * 2
    first, second = np.array([[1.0, 0.0]] * 3), np.array([[0.5, 0.5]] * 3)
    declaration, values = two("by_row", first, second)
    share_state(declaration, values, OF_ENTRIES, STATES, INITIAL)
    for value, own in zip(values, (first, second), strict=True):
        np.testing.assert_allclose(value, [[0.6875, 0.3125], own[1], [0.875, 0.125]], rtol=1e-15)


def test_the_heaviest_of_a_mixture_of_entries_is_the_agent_of_the_largest_total_weight() -> None:
    for mixture, heaviest in ((OF_ENTRIES, [1, 2, 3]), (OF_ENTRIES[::-1], [4, 5, 6]), (OF_ENTRIES[:, :0], [1, 2, 3])):
        declaration, values = two("heaviest", [1, 2, 3], [4, 5, 6], shape=("states",), dtype=np.int64)
        share_state(declaration, values, mixture, STATES[: mixture.shape[1]], INITIAL)
        assert [value.tolist() for value in values] == [heaviest] * 2


def test_what_is_copied_begins_anew_with_a_mixture_of_entries_even_of_one_entry() -> None:
    one_entry = np.array([[[0.0]], [[1.0]]])
    declaration, values = two("copied", [[5.0]], [[6.0]], initial=None)
    share_state(declaration, values, one_entry, np.array([0]), np.array([[1.5]]))
    assert [value.tolist() for value in values] == [[[1.5]]] * 2


@pytest.mark.parametrize("mixture", [MIXED, SECOND])
def test_heaviest_arrays_are_the_heaviest_agents(mixture: FloatArray) -> None:
    declaration, values = two("heaviest", [1, 2, 3], [4, 5, 6], shape=("states",), dtype=np.int64)
    share_state(declaration, values, mixture, np.array([0]), INITIAL)
    assert [value.tolist() for value in values] == [[4, 5, 6]] * 2
    values[0][0] = 9
    assert values[1][0] == 4, "copies, not the same memory"


def test_copied_arrays_go_along_with_a_copy_and_begin_anew_with_a_mixture() -> None:
    for initial, begun in ((0.0, np.zeros((3, 2))), (2.5, np.full((3, 2), 2.5)), (None, INITIAL)):
        declaration, values = two("copied", np.full((3, 2), 4.0), np.full((3, 2), 8.0), initial=initial)
        share_state(declaration, values, SECOND, None, INITIAL)
        assert [value.tolist() for value in values] == [[[8.0, 8.0]] * 3] * 2
        share_state(declaration, values, MIXED, None, INITIAL)
        for value in values:
            np.testing.assert_array_equal(value, begun)
        values[0][0] = 99.0
        assert values[1][0, 0] != 99.0, "copies, not the same memory"


@pytest.mark.parametrize("mixture", [MIXED, SECOND])
def test_arrays_that_are_not_shared_stay_with_their_agents(mixture: FloatArray) -> None:
    declaration, values = two("none", [1.0], [2.0], shape=(1,))
    share_state(declaration, values, mixture, None, INITIAL)
    assert [value.tolist() for value in values] == [[1.0], [2.0]]


class Notes:
    """A record: some numbers."""

    def __init__(self, *numbers: int) -> None:
        self.numbers = list(numbers)

    def to_arrays(self) -> dict[str, np.ndarray]:
        return {"numbers": np.array(self.numbers), "count": np.array(len(self.numbers))}

    def set_arrays(self, arrays: Mapping[str, np.ndarray]) -> None:
        self.numbers = arrays["numbers"].tolist()
        assert set(arrays) == {"numbers", "count"}

    def clear(self) -> None:
        self.numbers = []


def test_records_go_along_with_a_copy_and_begin_anew_with_a_mixture() -> None:
    declaration = DeclaredRecord("notes", "copied", lambda n_states, n_actions: Notes(n_states, n_actions))
    assert declaration.create(INITIAL).numbers == [3, 2]  # type: ignore[attr-defined]  # it is one of these
    notes = [Notes(1), Notes(2, 3), Notes()]
    share_state(declaration, notes, np.array([0.0, 1.0, 0.0]), None, INITIAL)
    assert [one.numbers for one in notes] == [[2, 3]] * 3
    share_state(declaration, notes, np.array([0.5, 0.5, 0.0]), None, INITIAL)
    assert [one.numbers for one in notes] == [[]] * 3
    own = DeclaredRecord("notes", "none", lambda n_states, n_actions: Notes())
    notes = [Notes(1), Notes(2)]
    share_state(own, notes, SECOND, None, INITIAL)
    assert [one.numbers for one in notes] == [[1], [2]]


# Saved and restored


def test_files_know_arrays_by_their_names() -> None:
    plain, grouped = DeclaredArray("counts", "none", (2,)), DeclaredArray("model.reward", "none", (2,))
    record = DeclaredRecord("notes", "none", lambda n_states, n_actions: Notes())
    held = saved_state(plain, np.array([1.0, 2.0])) | saved_state(grouped, np.array([3.0, 4.0]))
    held |= saved_state(record, Notes(5, 6))
    assert set(held) == {"arrays/counts", "arrays/model.reward", "records/notes/numbers", "records/notes/count"}
    arrays = SavedArrays.of(held | {"records/notes1/numbers": np.zeros(1)})
    one, other, notes = (read_state(each, arrays, INITIAL, finite=True) for each in (plain, grouped, record))
    assert (one.tolist(), other.tolist(), notes.numbers) == ([1, 2], [3, 4], [5, 6])


# A learner that declares one array of each kind


class KeeperState(NamedTuple):
    """What `Keeper` keeps for one agent."""

    total: FloatArray  # (S, A)
    chances: FloatArray  # (S, A)
    latest: IntArray  # (S,)
    trail: FloatArray  # (S, A)
    own: IntArray  # (2,)


@kernel
def update(algorithm: KeeperState, agent: AgentArrays, transition: Transition, next_action: int) -> bool:
    """Change one row of every array, and the values by what is in them."""
    state, action = transition.state, transition.action
    record_change(agent.log, state)
    algorithm.total[state, action] += transition.reward
    for other in range(agent.q.shape[1]):
        algorithm.chances[state, other] *= 0.5
    algorithm.chances[state, action] += 0.5
    algorithm.latest[state] = below(1000, agent.rng)
    algorithm.trail[state, action] += 1.0
    algorithm.own[0] += 1
    value = algorithm.total[state, action] * algorithm.chances[state, action] + algorithm.latest[state]
    agent.q[state, action] += agent.step_sizes[action] * (value + algorithm.trail[state, action] + algorithm.own[0])
    return True


register_algorithm(KeeperState, update=update)


class Keeper(Learner):
    """Keeps an array of every kind, and makes its values of them."""

    state_type = KeeperState

    def declare_state(self) -> tuple[Declaration, ...]:
        return (
            DeclaredArray("total", "by_entry", initial=None),
            DeclaredArray("chances", "by_row", initial=1 / self.problem.n_actions),
            DeclaredArray("memory.latest", "heaviest", ("states",), np.int64),
            DeclaredArray("memory.trail", "copied", initial=0.5),
            DeclaredArray("own", "none", (2,), np.int64),
        )


PROBLEM = random_mdp(21, n_states=9, n_outcomes=2, limit=8)


def held_by(learner: Learner) -> list[dict[str, Any]]:
    return [{name: array.copy() for name, array in declared.items()} for declared in learner.declared]


def test_every_kind_is_among_them() -> None:
    keeper = Keeper(PROBLEM, seed=1)
    shares = {declaration.share for declaration in keeper.declare_state()}
    assert shares == set(SHARING)
    assert set(held_by(keeper)[0]) == {"total", "chances", "memory.latest", "memory.trail", "own"}


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")
@pytest.mark.parametrize("mixture", [(0.25, 0.5, 0.25), (0.0, 1.0, 0.0)])
def test_a_tensor_step_shares_what_is_declared(mixture: tuple[float, ...]) -> None:
    before: list[list[dict[str, Any]]] = []

    def share(context: ShareContext) -> tuple[float, ...]:
        before.append(held_by(keeper))
        return mixture

    step = TensorStep(every=4, ranks=(2, 2, 2, 2), weights="none", share=share)
    keeper = Keeper(PROBLEM, n_agents=3, epsilon=0.5, initial_q=-0.5, tensor_step=step, seed=1)
    keeper.learn(4)
    ((first, second, third),) = before
    after = held_by(keeper)
    copied = max(mixture) == 1.0
    for held in after:
        for name in ("total", "chances"):
            expected = sum(part * one[name] for part, one in zip(mixture, (first, second, third), strict=True))
            np.testing.assert_allclose(held[name], expected, rtol=1e-13)
        np.testing.assert_array_equal(held["memory.latest"], second["memory.latest"])
        trail = second["memory.trail"] if copied else np.full((9, 3), 0.5)
        np.testing.assert_array_equal(held["memory.trail"], trail)
    assert not np.array_equal(first["memory.latest"], second["memory.latest"])
    assert [held["own"][0] for held in after] == keeper.steps.sum(axis=0).tolist()
    keeper.learn(1)
    assert not np.array_equal(*(held["total"] for held in held_by(keeper)[:2])), "copies, not the same memory"


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")
@pytest.mark.parametrize("share", [None, "mean", "best"])
def test_what_is_declared_survives_a_file(share: str | None, tmp_path: Path) -> None:
    step = None if share is None else TensorStep(every=4, ranks=(2, 2, 2, 2), share=share)

    def fresh() -> Keeper:
        return Keeper(PROBLEM, n_agents=2, epsilon=0.5, initial_q=-0.5, tensor_step=step, seed=3)

    part = fresh().learn(6)
    part.save(tmp_path / "keeper")
    again = Keeper.load(tmp_path / "keeper")
    for ours, theirs in zip(held_by(again), held_by(part), strict=True):
        for name, array in theirs.items():
            assert array.any()
            assert ours[name].dtype == array.dtype
            np.testing.assert_array_equal(ours[name], array)
    whole = fresh().learn(13)
    assert_same(again.learn(7), whole)
    assert_same(part.learn(7), whole)
    for ours, theirs in zip(held_by(again), held_by(whole), strict=True):
        for name, array in theirs.items():
            np.testing.assert_array_equal(ours[name], array)


def test_what_cannot_be_shared_so_is_refused() -> None:
    with pytest.raises(ParameterError, match=r"only arrays of floats can be mixed; 'counts' has dtype int64"):
        DeclaredArray("counts", "by_entry", dtype=np.int64)
    with pytest.raises(ParameterError, match=r"share of 'x' must be one of by_entry, .*; got 'all'"):
        DeclaredArray("x", "all")  # type: ignore[arg-type]  # that is what is tested
    with pytest.raises(ParameterError, match=r"share of 'traces' must be copied or none; got 'by_entry'"):
        DeclaredRecord("traces", "by_entry", lambda n, m: None)  # type: ignore[arg-type, return-value]  # as above


def test_a_row_of_zeros_stays_when_rows_are_mixed() -> None:
    tables = [np.array([[0.0, 0.0], [0.25, 0.75]]), np.array([[0.0, 0.0], [0.75, 0.25]])]
    share_state(DeclaredArray("pi", "by_row"), tables, np.array([0.5, 0.5]), None, np.zeros((2, 2)))
    for table in tables:
        np.testing.assert_array_equal(table, [[0.0, 0.0], [0.5, 0.5]])


class Adopting:
    """A record that keeps the arrays it is given, and has no attributes but that."""

    __slots__ = ("x",)

    def __init__(self) -> None:
        self.x: np.ndarray = np.zeros(3)

    def to_arrays(self) -> dict[str, np.ndarray]:
        """Return a copy."""
        return {"x": self.x.copy()}

    def set_arrays(self, arrays: SavedArrays) -> None:
        """Keep what is given."""
        self.x = arrays.take("x", np.float64, (3,))

    def clear(self) -> None:
        """Begin anew."""
        self.x = np.zeros(3)


def test_records_of_two_agents_never_share_an_array() -> None:
    declaration = DeclaredRecord("adopting", "copied", lambda n_states, n_actions: Adopting())
    records = [Adopting(), Adopting(), Adopting()]
    share_state(declaration, records, np.array([1.0, 0.0, 0.0]), None, INITIAL)
    held = saved_state(declaration, records[0])
    restore_state(declaration, records[1], held)
    records[1].x[0] = 99.0
    assert [record.x[0] for record in records] == [0.0, 99.0, 0.0]
    assert held["records/adopting/x"][0] == 0.0
    assert declared_bytes(declaration, 10, 10) == 24


@pytest.mark.parametrize("initial", [0.0, 0.5])
def test_rows_that_are_distributions_begin_as_such(initial: float) -> None:
    assert DeclaredArray("chances", "by_row", initial=initial).create(INITIAL)[0].sum() in (0.0, 1.0)
    deep = DeclaredArray("chances", "by_row", ("states", 7, "actions"), initial=initial).create(INITIAL)
    assert deep[0, 0].sum() in (0.0, 1.0), "rows lie along the last axis"


def test_other_rows_are_refused_when_they_are_made() -> None:
    with pytest.raises(ParameterError, match=r"let `initial` be 0 or 1 / 2.*got 0.25"):
        DeclaredArray("chances", "by_row", initial=0.25).create(INITIAL)
