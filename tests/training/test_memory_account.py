"""The account of what a learner will need is what it then has, and what does not fit is refused before it is made."""

from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import pytest

from tests.learners.worlds import corridor
from tests.problems.test_simulator import index, reset, step
from tuckerl import DynaH, QLearning, SarsaLambda, Simulator, TensorStep, memory, random_maze
from tuckerl.errors import TableSizeError
from tuckerl.training import learner as learner_module
from tuckerl.training import memory_account
from tuckerl.training.declared_state import DeclaredArray
from tuckerl.training.memory_account import declared_bytes, learner_parts
from tuckerl.training.training_state import TrainingState

STEP = TensorStep(every=7, ranks=(1, 1, 1, 1))


def bytes_of(held: Any) -> int:
    parts = [held] if isinstance(held, np.ndarray) else held
    return sum(part.nbytes for part in parts if isinstance(part, np.ndarray))


@pytest.mark.parametrize("kind", [SarsaLambda, DynaH])
def test_the_account_is_what_a_learner_has(kind: type[Any]) -> None:
    made = kind(corridor(37), n_agents=3, tensor_step=STEP)
    declarations = made._state.declarations
    assert declarations
    for declaration in declarations:
        assert declared_bytes(declaration, 37, 2) == bytes_of(made.declared[0][declaration.name]), declaration.name
    parts = {part.name: part.n_bytes for part in learner_parts(made.problem, 3, STEP, declarations)}
    assert parts["Q-tables"] == made.q.nbytes
    assert parts["trajectories"] == 3 * 2 * made._state.latest_trajectory(0).nbytes
    undo = [log.stamp.nbytes + log.undo_state.nbytes + log.undo_row.nbytes for log in made.change_logs]
    assert parts["what is kept to undo an episode"] == sum(undo)
    assert parts["changes of a window"] == sum(log.state.nbytes + log.row.nbytes for log in made.change_logs)
    assert parts["tensors of a window and of the one before"] == 2 * 37 * 2 * 7 * 3 * 8


def test_an_authors_array_is_counted_from_its_declaration() -> None:
    declaration = DeclaredArray("counts", "none", ("states", "actions", 3), np.int32)
    assert declared_bytes(declaration, 10, 2) == declaration.create(np.zeros((10, 2))).nbytes


def test_masks_and_simulated_states_are_counted_for_every_world() -> None:
    problem = Simulator(reset, step, index, n_states=5, n_actions=2, state_size=1000)
    parts = {part.name: part.n_bytes for part in learner_parts(problem, 3, None, ())}
    assert parts["worlds"] == pytest.approx(3 * 2000 * 8, rel=0.01)


class Heavy(gymnasium.Env[Any, Any]):
    """An environment with a large array, part of which has a name of its own."""

    observation_space = action_space = gymnasium.spaces.Discrete(2)

    def __init__(self, length: int) -> None:
        self.held = {"data": [np.broadcast_to(0.0, length)]}
        self.first = self.held["data"][0]

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[int, dict[str, Any]]:
        return 0, {}

    def step(self, action: int) -> tuple[int, float, bool, bool, dict[str, Any]]:
        return 0, 0.0, True, False, {}


def test_copies_of_an_environment_are_counted_by_its_arrays() -> None:
    problem = QLearning(gymnasium.wrappers.TransformReward(Heavy(1000), float)).problem
    for n_agents, n_bytes in ((1, 0), (4, 3 * 8000)):
        parts = {part.name: part.n_bytes for part in learner_parts(problem, n_agents, None, ())}
        assert parts["copies of the environment"] == n_bytes


def simulator(**sizes: Any) -> Simulator:
    return Simulator(reset, step, index, **({"n_states": 5, "n_actions": 2, "max_episode_steps": 9} | sizes))


TOO_LARGE: dict[str, tuple[Callable[[], Any], str]] = {
    "states": (lambda: QLearning(simulator(n_states=10**18)), r"Q-tables about 10\^19 bytes.* coarser bins"),
    "actions": (lambda: QLearning(simulator(n_actions=2**62)), "Q-tables about"),
    "agents": (lambda: QLearning(corridor(), n_agents=10**9), r"agents [\d,]+ bytes \(.*use fewer agents"),
    "state_size": (lambda: QLearning(simulator(state_size=10**12)), r"worlds 16,000,[0-9,]+ bytes"),
    "every": (lambda: QLearning(corridor(), tensor_step=TensorStep(10**30, (1, 1, 1, 1))), "a smaller `every`"),
    "traces": (lambda: SarsaLambda(simulator(n_states=10**11)), "SarsaLambda would take .*'traces' 4,400,"),
    "model": (lambda: DynaH(simulator(n_states=10**11)), "DynaH would take .*Q-tables"),
    "a random maze": (lambda: random_maze(10**6, 10**6), "a random maze would take .*fewer rows or columns"),
    "copies": (lambda: QLearning(Heavy(10**13), n_agents=3), "copies of the environment 160,[0-9,]+ bytes.*fewer ag"),
    "a copy": (lambda: QLearning(Heavy(10**13)).evaluate(1), "evaluating would take .*a copy of the environment 80,"),
    "evaluate": (lambda: QLearning(corridor()).evaluate(10**12), "evaluating would take .*evaluate fewer episodes"),
    "learn": (lambda: QLearning(corridor()).learn(10**30), r"learning would take about 10\^31 .*fewer episodes"),
}


@pytest.mark.parametrize("case", TOO_LARGE)
def test_what_does_not_fit_is_refused_before_it_is_made(case: str) -> None:
    make, message = TOO_LARGE[case]
    with pytest.raises(TableSizeError, match=message) as caught:
        make()
    assert len(str(caught.value)) <= 600


def test_nothing_is_allocated_before(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = corridor(100_000)

    def allocates(*arguments: Any, **parameters: Any) -> TrainingState:
        raise AssertionError("the tables were made first")

    monkeypatch.setattr(memory, "available_memory", lambda: 3_000_000)
    monkeypatch.setattr(learner_module, "TrainingState", allocates)
    with pytest.raises(TableSizeError, match=r"QLearning would take [\d,]+ bytes .*Q-tables 4,800,000 bytes"):
        QLearning(problem, n_agents=3)


def test_a_long_window_is_counted_by_what_acting_can_touch(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = corridor(10_000, limit=9)

    def changes() -> int:
        parts = learner_parts(problem, 1, TensorStep(every=100, ranks=(1, 1, 1, 1)), ())
        return next(part.n_bytes for part in parts if part.name == "changes of a window")

    assert changes() == 100 * 10 * 3 * 8
    monkeypatch.setattr(memory_account, "available_memory", lambda: 10**6)  # not even addresses for so much
    assert changes() == 100 * 10_000 * 3 * 8


def test_small_numbers_of_numpys_are_counted_without_overflow() -> None:
    episodes: Any = np.int8(100)  # of which 100 * 2 * 8 is none
    assert QLearning(corridor(3), seed=0).learn(episodes).episodes == 100
