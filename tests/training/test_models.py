"""What learners that plan keep: models in files, in undone episodes, in copies, and under parameters assigned later."""

import re
from collections.abc import Callable
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.learners.worlds import corridor, random_mdp
from tests.training import crafted_files as crafted
from tests.training.crafted_files import Parts, take_apart
from tests.training.test_faults import Faulty
from tests.training.test_resume import assert_same
from tuckerl import DynaQ, DynaQPlus, PrioritizedSweeping, RMax, TensorStep, load
from tuckerl.errors import EnvironmentFaultError, ImmutableError, SavedFileError
from tuckerl.learners.priority_queue import insert

PROBLEM = random_mdp(31, n_states=9, n_outcomes=2, random_start=True)
STEP = TensorStep(every=4, ranks=(4, 2, 3, 1), weights="constant", share="mean")
NO_STEP = TensorStep(every=4, ranks=(4, 2, 3, 1), weights="none", share="none")  # for a table that a model makes
KINDS: dict[str, tuple[Any, dict[str, Any]]] = {
    "dyna-q": (DynaQ, {"planning_steps": 3}),
    "dyna-q-plus": (DynaQPlus, {"planning_steps": 3, "kappa": 0.1}),
    "prioritized-sweeping": (PrioritizedSweeping, {"planning_steps": 2, "theta": 0.0}),  # so that pairs stay queued
    "r-max": (RMax, {"m": 4, "r_max": 10.0}),
}

pytestmark = pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")


def make(name: str, problem: Any = PROBLEM, **parameters: Any) -> Any:
    kind, own = KINDS[name]
    settings: dict[str, Any] = {"epsilon": 0.4, "n_agents": 2, "seed": 6}
    return kind(problem, **settings | own | parameters)


def assert_same_models(one: Any, other: Any) -> None:
    assert_same(one, other)
    for ours, theirs in zip(one.declared, other.declared, strict=True):
        for name, array in ours.items():
            if name == "queue":
                array, other_array = (queue.to_arrays() for queue in (array, theirs[name]))
                np.testing.assert_equal(array, other_array)
            else:
                np.testing.assert_array_equal(array, theirs[name], err_msg=name)


@pytest.mark.parametrize("name", KINDS)
@pytest.mark.parametrize("step", [None, STEP])
def test_going_on_from_a_file_or_a_copy_gives_the_same_bits(name: str, step: Any, tmp_path: Path) -> None:
    own = {"tensor_step": NO_STEP if step and name == "r-max" else step}
    whole, pieces = make(name, **own).learn(11), make(name, **own)
    for piece in (3, 2, 6):
        pieces.save(tmp_path / "agent")
        copy = deepcopy(pieces)
        pieces = load(tmp_path / "agent").learn(piece)
        assert_same_models(copy.learn(piece), pieces)
    assert_same_models(pieces, whole)


@pytest.mark.parametrize("name", KINDS)
def test_an_episode_that_is_broken_off_leaves_no_trace(name: str) -> None:
    # The environment fails in the middle of an episode; what that episode changed in tables and models is undone.
    # Many states and outcomes: what is changed of a model is then often in a row that the episode has not visited.
    def fresh(*faults: int) -> Any:
        env = Faulty(faults, random_mdp(5, n_states=40, n_outcomes=3, limit=12))
        return make(name, env, n_agents=1, **({"theta": 0.5} if name == "prioritized-sweeping" else {}))

    learner, whole, n_failures = fresh(17, 30, 31, 44, 57, 71, 83, 95), fresh(), 0
    while learner.episodes < 12:
        try:
            learner.learn(12 - learner.episodes)
        except EnvironmentFaultError:
            n_failures += 1
            assert_same_models(learner, fresh().learn(learner.episodes) if learner.episodes else fresh())
    assert n_failures >= 5
    assert_same_models(learner, whole.learn(12))


# Files that lie


@pytest.fixture(scope="module")
def parts(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Parts]:
    path, found = tmp_path_factory.mktemp("models") / "agent", {}
    for name in KINDS:
        make(name, corridor(), n_agents=1).learn(4).save(path)
        found[name] = take_apart(path.read_bytes())
    return found


def put(value: Any, place: Any = 0) -> Callable[[np.ndarray], None]:
    return lambda array: array.__setitem__(place, value)


def change_record(field: str, value: Any) -> Callable[[np.ndarray], None]:
    """Change a field of the first record that is in use: every step of a corridor costs 1."""

    def change(array: np.ndarray) -> None:
        array[field][tuple(np.argwhere(array["reward"] != 0.0)[0])] = value

    return change


DYNA_LIES: list[tuple[str, Callable[[np.ndarray], Any], str]] = [
    ("model.tried", put(2), "model.tried must be at least 0 and at most 1"),
    ("model.tried", put(1, slice(None)), "actions that a model has of a state must be different ones"),
    ("model.n_tried", put(3), "model.n_tried must be at least 0 and at most 2"),
    ("model.n_tried", put(0), "observed states of a model must be those in which an action was tried"),
    ("model.observed", put(5), "model.observed must be at least 0 and at most 4"),
    ("model.observed", put(1, slice(None)), "observed states of a model must be those in which"),
    ("model.n_observed", put(6), "model.n_observed must be at least 0 and at most 5"),
    ("model.n_observed", put(1), "observed states of a model must be those in which"),
    ("model.outcome", change_record("next_state", 5), "outcomes of a model must lead to states"),
    ("model.outcome", change_record("reward", np.inf), "outcomes of a model must lead to states, with finite rewards"),
    ("model.outcome", change_record("discount", 1.5), "outcomes of a model must lead to states"),
    ("model.outcome", change_record("discount", np.nan), "outcomes of a model must lead to states"),
]
LIES: list[tuple[str, str, Callable[[np.ndarray], Any], str]] = [
    *(("dyna-q", *lie) for lie in DYNA_LIES),
    ("dyna-q-plus", *DYNA_LIES[1]),
    ("dyna-q-plus", "model.last_tried", put(-1), "model.last_tried must be at least 0"),
    ("dyna-q-plus", "model.last_tried", put(0, slice(None)), "pairs that a model knows must have been tried"),
    ("dyna-q-plus", "model.last_tried", put(2**61), "the last one in its latest step"),
    ("dyna-q-plus", "model.clock", put(0), "the last one in its latest step"),
    ("r-max", "model.n_tried", put(5), "model.n_tried must be at least 0 and at most 4"),
    ("r-max", "model.n_tried", put(0, (0, slice(None))), "observed states of a model must be those in which an action"),
    ("r-max", "model.n_counted", put(0), "outcomes that a model counts must lead to states, and be as many as"),
    ("r-max", "model.n_counted", put(2), "outcomes that a model counts must lead to states"),
    ("r-max", "model.counted", lambda a: a["count"].__setitem__((0, 0, 0), 9), "and be as many as its trials"),
    ("r-max", "model.counted", lambda a: a["next_state"].__setitem__(slice(None), 5), "must lead to states"),
    ("r-max", "model.counted", lambda a: a["discount"].__setitem__((0, 0, 0), 1.5), "must lead to states"),
    ("r-max", "model.paid", put(np.nan), "outcomes that a model counts"),
    ("r-max", "model.observed", put(1, slice(None)), "observed states of a model"),
    ("r-max", "model.n_observed", put(6), "model.n_observed must be at least 0 and at most 5"),
    (
        "prioritized-sweeping",
        "model.outcome",
        change_record("next_state", 5),
        "outcomes of a model must lead to states",
    ),
    ("prioritized-sweeping", "model.outcome", change_record("next_state", 4), "predecessors of a model's states"),
    ("prioritized-sweeping", "model.outcome", change_record("discount", 0.0), "predecessors of a model's states"),
    ("prioritized-sweeping", "model.known", put(False, slice(None)), "nothing of pairs that it does not know"),
    ("prioritized-sweeping", "predecessors.first", put(11), "first must be at least 0 and at most 10"),
    ("prioritized-sweeping", "predecessors.following", put(-1), "following must be at least 0 and at most 10"),
    ("prioritized-sweeping", "predecessors.preceding", put(1, slice(None)), "predecessors of a model's states"),
]


@pytest.mark.parametrize(("name", "array", "change", "message"), LIES)
def test_a_model_that_contradicts_itself_is_refused(
    name: str, array: str, change: Callable[[np.ndarray], Any], message: str, parts: dict[str, Parts], tmp_path: Path
) -> None:
    kept = parts[name]
    altered = kept.arrays[f"agents/0/arrays/{array}"].copy()
    change(altered)
    crafted.rewrite(tmp_path / "agent", kept._replace(arrays=kept.arrays | {f"agents/0/arrays/{array}": altered}))
    with pytest.raises(SavedFileError, match="agent") as caught:
        load(tmp_path / "agent")
    assert re.search(message, str(caught.value))


def test_a_queue_of_pairs_that_the_model_does_not_know_is_refused() -> None:
    held = make("prioritized-sweeping").learn(1).declared[0]
    unknown = int(np.flatnonzero(~held["model.known"])[0])
    make("prioritized-sweeping").check_declared(held)
    insert(held["queue"], unknown, 1.0)
    with pytest.raises(SavedFileError, match="a queue must hold pairs that the model knows"):
        make("prioritized-sweeping").check_declared(held)


def test_predecessors_follow_the_discounts() -> None:
    # With bootstrap_terminal a state's value counts for pairs that end, too; with gamma 0 for none.
    learner = make("prioritized-sweeping", gamma=0.5).learn(8)
    n_linked = [np.count_nonzero(held["predecessors.first"]) for held in learner.declared]
    learner.bootstrap_terminal = True
    for held, before in zip(learner.declared, n_linked, strict=True):
        assert np.count_nonzero(held["predecessors.first"]) >= before
        learner.check_declared(held)
        assert (held["model.outcome"]["discount"][held["model.known"]] == 0.5).all()
    other = make("prioritized-sweeping", gamma=0.5).learn(8)
    other.gamma = 0.0
    for held in other.declared:
        assert not held["predecessors.first"].any()
        other.check_declared(held)


# Parameters that are assigned later

CHANGES: list[tuple[str, str, Any]] = [
    ("dyna-q", "planning_steps", 1),
    ("dyna-q", "gamma", 0.3),
    ("dyna-q", "bootstrap_terminal", True),
    ("dyna-q-plus", "kappa", 0.5),
    ("dyna-q-plus", "gamma", 0.3),
    ("prioritized-sweeping", "planning_steps", 5),
    ("r-max", "epsilon", 0.9),
    ("prioritized-sweeping", "theta", 3.0),
    ("prioritized-sweeping", "gamma", 0.3),
    ("prioritized-sweeping", "bootstrap_terminal", True),
]


@pytest.mark.parametrize(("name", "parameter", "value"), CHANGES)
def test_what_is_assigned_later_is_in_force_and_in_the_file(
    name: str, parameter: str, value: Any, tmp_path: Path
) -> None:
    first, changed, unchanged = make(name), make(name).learn(13), make(name).learn(13)
    setattr(first, parameter, value)
    assert_same_models(first.learn(5), make(name, **{parameter: value}).learn(5))
    setattr(changed, parameter, value)
    changed.save(tmp_path / "agent")
    again = load(tmp_path / "agent")
    assert getattr(again, parameter) == value
    assert_same_models(again.learn(6), changed.learn(6))
    assert not np.array_equal(changed.q, unchanged.learn(6).q)


@pytest.mark.parametrize("name", [name for name in KINDS if name != "r-max"])  # its gamma is fixed
def test_models_get_the_discounts_of_now(name: str) -> None:
    learner, other = make(name, gamma=0.5).learn(8), make(name, gamma=0.5).learn(8)
    learner.change({"gamma": 0.25})
    for held, before in zip(learner.declared, other.declared, strict=True):
        was, now = before["model.outcome"]["discount"], held["model.outcome"]["discount"]
        assert (was == 0.5).any()
        np.testing.assert_array_equal(now, np.where(was == 0.5, 0.25, 0.0))
    learner.gamma = 0.0
    with pytest.raises(ImmutableError, match="cannot tell them apart; make a new learner"):
        learner.gamma = 0.5
    assert learner.gamma == 0.0
