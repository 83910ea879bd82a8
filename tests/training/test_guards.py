"""Kernels of users' own that do something impossible: it is said, nothing is harmed, and learning can go on."""

import re
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import pytest

import tuckerl
from tests.adapters.parallel_worlds import Leaving
from tests.learners.worlds import corridor
from tuckerl import HAQL, QLearning, SarsaLambda, TabularMDP, TensorStep
from tuckerl.errors import LearnerError, ParameterError, ParameterTypeError
from tuckerl.generalization.change_log import record_change
from tuckerl.problems.dynamics import register_dynamics, register_shared_dynamics
from tuckerl.problems.problem import Problem
from tuckerl.problems.worlds import World
from tuckerl.rng import below
from tuckerl.training.agent_arrays import AgentArrays, Transition
from tuckerl.training.algorithm import NOT_FINITE, register_algorithm
from tuckerl.training.learner import Learner
from tuckerl.training.policies.policy import Policy, register_policy
from tuckerl.types import FloatArray, IntArray, Stream

pytestmark = pytest.mark.slow

FIRST, LATER = 0, 5  # steps before the slip


class SlipState(NamedTuple):
    """An algorithm that is right until it has made so many steps."""

    slip: int
    left: IntArray  # (1,) steps until then


(TOO_LOW, TOO_HIGH, A_FRACTION, FORBIDDEN, READS, WRITES, STRAYS, ENDS_BADLY, GIVES_UP) = range(9)


@tuckerl.kernel
def act(algorithm: SlipState, agent: AgentArrays, state: int) -> Any:
    """Go right, or slip."""
    slip = algorithm.slip if algorithm.left[0] <= 0 else -1
    algorithm.left[0] -= 1
    if slip == TOO_LOW:
        return -2.0
    if slip == TOO_HIGH:
        return 2.0 + agent.q.shape[1]
    if slip == A_FRACTION:
        return 0.5
    if slip == FORBIDDEN:
        return 2.0
    if slip == READS:
        return agent.q[agent.q.shape[0], 0]
    if slip == GIVES_UP:
        return NOT_FINITE
    return 1.0


@tuckerl.kernel
def update(algorithm: SlipState, agent: AgentArrays, transition: Transition, next_action: int) -> bool:
    """Learn nothing, or slip."""
    if algorithm.left[0] <= 0 and algorithm.slip == WRITES:
        agent.q[0, 10_000_000] = 1.0
    record_change(agent.log, -3 if algorithm.left[0] <= 0 and algorithm.slip == STRAYS else transition.state)
    return True


@tuckerl.kernel
def end_episode(algorithm: SlipState, agent: AgentArrays, finished: bool) -> bool:
    """End, or slip."""
    return algorithm.slip != ENDS_BADLY or agent.weights[agent.weights.size + algorithm.slip] > 0.0


register_algorithm(SlipState, act=act, update=update, end_episode=end_episode)


class Slips(Learner):
    """A learner with a slip."""

    state_type = SlipState

    def __init__(self, env: Any, *, slip: int, after: int = FIRST, **parameters: Any) -> None:
        self.slip, self.after = slip, after
        super().__init__(env, **parameters)
        self.left = np.array([after])

    def constants(self) -> dict[str, Any]:
        return {"slip": self.slip, "left": self.left}


def masked(length: int = 8) -> TabularMDP:
    arrays = corridor(length).arrays
    mask = np.tile([True, True, False], (length, 1))
    three = [
        np.hstack([array.reshape(length, 2), array.reshape(length, 2)[:, :1]])
        for array in (arrays.next_state, arrays.reward, arrays.terminated)
    ]
    return TabularMDP(*three, max_episode_steps=20, action_mask=mask)


STEP = TensorStep(every=10, ranks=(2, 2, 2, 1))  # rows are recorded
MESSAGES = [
    (TOO_LOW, "act of SlipState must return an action from 0 to 2; it returned -2 in state {}"),
    (TOO_HIGH, "act of SlipState must return an action from 0 to 2; it returned 5 in state {}"),
    (A_FRACTION, "act of SlipState must return an action from 0 to 2; it returned 0.5 in state {}"),
    (FORBIDDEN, "act of SlipState returned action 2 in state {}, where it is forbidden: look at agent.action_mask"),
    (READS, "act of SlipState raised an error in state {}, or reached outside of an array: .*check_learner says which"),
    (STRAYS, "update of SlipState must record rows from 0 to 7 by record_change; it recorded -3 in state "),
    (WRITES, "update of SlipState raised an error in state "),
]


@pytest.mark.parametrize(("slip", "message"), MESSAGES)
@pytest.mark.parametrize("after", [FIRST, LATER])
def test_what_an_algorithms_kernels_must_not_do_stops_learning(slip: int, message: str, after: int) -> None:
    learner = Slips(masked(), slip=slip, after=after, tensor_step=STEP, seed=0)
    with pytest.raises(LearnerError, match="Slips: " + message.format(after)):
        learner.learn(3)
    assert learner.episodes == 0
    assert learner.diverged_at is None
    assert not learner.q.any()
    learner.left[0] = 1000  # its author has put it right
    assert learner.learn(3).episodes == 3


def test_an_error_at_an_episodes_end_is_one_too() -> None:
    with pytest.raises(LearnerError, match=r"Slips: end_episode of SlipState raised an error, or reached outside"):
        Slips(masked(), slip=ENDS_BADLY, seed=0).learn(3)


def test_an_algorithm_may_say_that_values_are_not_finite_instead_of_acting() -> None:
    for after in (FIRST, LATER):
        with pytest.warns(tuckerl.errors.DivergenceWarning):
            assert Slips(masked(), slip=GIVES_UP, after=after, seed=0).learn(3).diverged_at == 0


@pytest.mark.parametrize("after", [FIRST, 2])
def test_of_agents_in_one_world_every_one_is_watched(after: int) -> None:
    learner = Slips(Leaving(), slip=TOO_HIGH, after=after, seed=0)
    with pytest.raises(LearnerError, match="act of SlipState must return an action from 0 to"):
        learner.learn(2)
    learner.left[0] = 1000
    assert learner.learn(2).episodes == 2


class WildArrays(NamedTuple):
    """What a policy with a slip reads."""

    slip: int
    scheduled: FloatArray


@tuckerl.kernel
def choose(policy: WildArrays, agent: AgentArrays, state: int) -> int:
    """Choose at random, or slip."""
    if policy.slip == TOO_LOW:
        return -1
    if policy.slip == FORBIDDEN:
        return 2
    if policy.slip == READS:
        return int(agent.scheduled[agent.scheduled.size + state])
    return below(2, agent.rng)


@tuckerl.kernel
def probabilities(policy: WildArrays, agent: AgentArrays, state: int, out: FloatArray) -> None:
    """Write what is none, or too much of it."""
    out[:] = 0.25
    if policy.slip == WRITES:
        out[out.size] = 0.25


register_policy(WildArrays, choose=choose, probabilities=probabilities)


class Wild(Policy):
    """A policy with a slip."""

    def __init__(self, slip: int) -> None:
        self.slip = slip

    def arrays(self, scheduled: FloatArray, declared: Mapping[str, Any]) -> WildArrays:
        return WildArrays(self.slip, scheduled)


@pytest.mark.parametrize("kind", [QLearning, SarsaLambda])
@pytest.mark.parametrize(
    ("slip", "message"),
    [
        (TOO_LOW, "choose of WildArrays must return an action from 0 to 2; it returned -1 in state 0"),
        (FORBIDDEN, "choose of WildArrays returned action 2 in state 0, where it is forbidden"),
        (READS, "choose of WildArrays raised an error in state 0, or reached outside of an array"),
    ],
)
def test_what_a_policys_kernels_must_not_do_stops_learning_and_evaluation(kind: Any, slip: int, message: str) -> None:
    learner = kind(masked(), policy=Wild(slip), seed=0)
    with pytest.raises(LearnerError, match=f"{kind.__name__}: {message}"):
        learner.learn(2)
    assert learner.episodes == 0
    if kind is QLearning:
        with pytest.raises(LearnerError, match=f"evaluate: {message}"):
            learner.evaluate(2, deterministic=False)


@pytest.mark.parametrize(
    ("slip", "message"),
    [
        (
            TOO_LOW,
            r"probabilities of WildArrays must write numbers from 0 that sum to 1; in state 3 it wrote \[0.25, 0.25, ",
        ),
        (WRITES, "predict: probabilities of WildArrays raised an error in state 3"),
    ],
)
def test_what_is_no_distribution_predicts_nothing(slip: int, message: str) -> None:
    with pytest.raises(LearnerError, match=message):
        QLearning(masked(), policy=Wild(slip), seed=0).predict(3, deterministic=False)
    with pytest.raises(LearnerError, match=message):  # also within a policy of ours
        HAQL(masked(), policy=Wild(slip), heuristic=np.arange(8.0), seed=0).predict(3, deterministic=False)


class Unlisted(NamedTuple):
    """What a policy reads whose kernels nobody registers."""


class Kernelless(Policy):
    """A policy without kernels."""

    def arrays(self, scheduled: FloatArray, declared: Mapping[str, Any]) -> Unlisted:
        return Unlisted()


class NoAlgorithm(NamedTuple):
    """A state whose kernels nobody registers."""


class WithoutKernels(Learner):
    """A learner without kernels."""

    state_type = NoAlgorithm


def test_what_has_no_kernels_is_refused_at_once() -> None:
    with pytest.raises(
        LearnerError, match=r"registered for Unlisted, which arrays\(\) of Kernelless returns: call regi"
    ):
        QLearning(corridor(), policy=Kernelless())
    with pytest.raises(
        LearnerError, match="no kernels are registered for NoAlgorithm, the state_type of WithoutKernels"
    ):
        WithoutKernels(corridor())


class LineArrays(NamedTuple):
    """What kernels read of a line that leads out of the table."""

    start: int
    last: int
    max_episode_steps: int


@tuckerl.kernel
def reset(world: LineArrays, rng: Stream) -> int:
    """Begin where it is said, which may be nowhere."""
    return world.start


@tuckerl.kernel
def step(world: LineArrays, state: int, action: int, rng: Stream) -> tuple[int, float, bool]:
    """Go one further, or read outside of the stream after the last."""
    if state == world.last:
        return int(rng[4 + state]), 0.0, False
    return state + 1, 1.0, False


register_dynamics(LineArrays, reset=reset, step=step)


class Line(Problem):
    """A line of four states that goes on where there are none."""

    kind, title, how_played, is_data = "line", "line", "compiled line", False

    def __init__(self, start: int = 0, last: int = 100) -> None:
        super().__init__(4, 2, max_episode_steps=50)
        self._arrays = LineArrays(start, last, 50)

    def world(self) -> World:
        return World(self._arrays)

    save = restore = None  # type: ignore[assignment]  # nobody saves it


@pytest.mark.parametrize(
    ("problem", "value"), [(Line(4), 4), (Line(-1), -1), (Line(10**12), 10**12), (Line(), 4), (Line(last=2), -1)]
)
def test_states_of_a_kind_of_problem_of_ones_own_are_looked_at(problem: Line, value: int) -> None:
    learner = QLearning(problem, seed=0)
    message = rf"the kernels of LineArrays must give states from 0 to 3; they gave {value} \(an error"
    with pytest.raises(LearnerError, match="QLearning: " + message):
        learner.learn(2)
    assert learner.episodes == 0
    with pytest.raises(LearnerError, match="evaluate: " + message):
        learner.evaluate(2)


class Wordy(NamedTuple):
    """A state whose kernel knows words."""


@tuckerl.kernel
def speak(algorithm: Wordy, agent: AgentArrays, transition: Transition, next_action: int) -> bool:
    """Look into a dictionary, which no kernel has."""
    return {"left": transition.action}.get("right") is None


register_algorithm(Wordy, update=speak)


class Speaking(Learner):
    """A learner whose kernel cannot be compiled."""

    state_type = Wordy


@pytest.mark.compiled
def test_a_kernel_that_cannot_be_compiled_is_said_in_one_sentence() -> None:
    with pytest.raises(LearnerError, match="a kernel of your own cannot be compiled: it may use numbers") as refused:
        Speaking(corridor(), seed=0).learn(1)
    assert "Failed in nopython mode" in str(refused.value.__cause__)


class Holder(NamedTuple):
    """A state that holds what kernels know nothing of."""

    words: Any


register_algorithm(Holder, update=lambda algorithm, agent, transition, next_action: True)


class Holding(Learner):
    """A learner whose state is no array or number."""

    state_type = Holder

    def algorithm_state(self, *arguments: Any) -> Holder:
        return Holder({"left": 0})


@pytest.mark.compiled
def test_a_state_of_other_things_than_arrays_and_numbers_is_said_in_one_sentence() -> None:
    with pytest.raises(LearnerError, match="a kernel of your own cannot be compiled: it may use numbers"):
        Holding(corridor(), seed=0).learn(1)


class RingArrays(NamedTuple):
    """What kernels read of a ring of states."""

    n_states: int


register_dynamics(
    RingArrays,
    reset=lambda world, rng: 0,
    step=lambda world, state, action, rng: ((state + 1) % world.n_states, 1.0, False),
    is_out_of_time=lambda world, steps: steps >= 7,
    must_return=lambda world: False,
)


class Ring(Line):
    """A ring of four states, of which plain functions tell."""

    def __init__(self) -> None:
        Problem.__init__(self, 4, 2, max_episode_steps=50)
        self._ring = RingArrays(4)

    def world(self) -> World:
        return World(self._ring)


def test_dynamics_may_be_plain_functions() -> None:
    assert QLearning(Ring(), seed=0).learn(3).steps.tolist() == [[7]] * 3


@tuckerl.kernel
def of_none() -> bool:
    """Take no arguments, as no kernel that can be registered does."""
    return True


@tuckerl.kernel
def of_two(world: LineArrays, begin: bool) -> None:
    """Do nothing."""


NONE = NoAlgorithm  # under which nothing is registered
REGISTER: dict[str, Any] = {
    "update must take (algorithm, agent, transition, next_action)": lambda f: register_algorithm(NONE, update=f),
    "act must take (algorithm, agent, state)": lambda f: register_algorithm(NONE, update=update, act=f),
    "end_episode must take (algorithm, agent, finished)": (
        lambda f: register_algorithm(NONE, update=update, end_episode=f)
    ),
    "choose must take (policy, agent, state)": (
        lambda f: register_policy(Unlisted, choose=f, probabilities=probabilities)
    ),
    "probabilities must take (policy, agent, state, out)": (
        lambda f: register_policy(Unlisted, choose=choose, probabilities=f)
    ),
    "reset must take (world, rng)": lambda f: register_dynamics(Unlisted, reset=f, step=step),
    "step must take (world, state, action, rng)": lambda f: register_dynamics(Unlisted, reset=reset, step=f),
    "step_together must take (world, begin)": lambda f: register_shared_dynamics(Unlisted, step_together=f),
    "must_return must take (world)": (
        lambda f: register_shared_dynamics(Unlisted, step_together=of_two, must_return=f)
    ),
}


@pytest.mark.parametrize("expected", REGISTER)
def test_kernels_that_take_other_arguments_are_refused(expected: str) -> None:
    with pytest.raises(ParameterError, match=re.escape(f"{expected}; got ") + r".*of_none.*, of \(\)"):
        REGISTER[expected](of_none)
    with pytest.raises(ParameterTypeError, match="must be a function of"):
        REGISTER[expected](3)
    test_what_has_no_kernels_is_refused_at_once()  # nothing was registered
