"""What a kernel sees of an environment that Python steps."""

from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

from tests.adapters.parallel_worlds import Masked, Unequal
from tuckerl._jit import call_python, python_callback
from tuckerl.adapters.gymnasium_problem import GymnasiumProblem, GymnasiumWorld
from tuckerl.adapters.joint import JointEnv
from tuckerl.adapters.python_world import FAULT, YIELD
from tuckerl.errors import EnvironmentFaultError, ProblemError
from tuckerl.problems.dynamics import is_out_of_time, must_return, reset, step
from tuckerl.problems.parts import STEP_CAP
from tuckerl.rng import seed_sequence, stream

RNG = stream(seed_sequence(0))


class Stairs(gymnasium.Env[Any, Any]):
    """Floors -2 to 2, actions down (3), stay (4), up (5); each pays its floor; the top ends, the bottom is cut off."""

    observation_space = spaces.Discrete(5, start=-2)
    action_space = spaces.Discrete(3, start=3)

    def __init__(self) -> None:
        self.floor, self.taken = 0, []  # type: ignore[var-annotated]

    def reset(self, *, seed: int | None = None, options: Any = None) -> Any:
        super().reset(seed=seed)
        self.floor = 0
        return self.floor, {}

    def step(self, action: Any) -> Any:
        self.taken.append(action)
        self.floor += action - 4
        return self.floor, np.float32(self.floor), self.floor == 2, self.floor == -2, {}


def world_of(env: Any, **parameters: Any) -> GymnasiumWorld:
    world = GymnasiumProblem(env, "stairs", **parameters).world()
    world.seed(seed_sequence(1))
    world.set_deadline(60.0)
    return world


def test_numbers_go_in_and_out() -> None:
    env = Stairs()
    problem = GymnasiumProblem(env, "stairs")
    assert (problem.n_states, problem.n_actions, problem.action_sizes) == (5, 3, (3,))
    assert (problem.max_episode_steps, problem.is_capped, problem.has_masks) == (STEP_CAP, True, False)
    assert repr(problem) == "GymnasiumProblem(stairs, 5 states, 3 actions, max_episode_steps=100000)"
    world = world_of(env)
    assert reset(world.arrays, RNG) == 2
    assert step(world.arrays, 2, 2, RNG) == (3, 1.0, False)
    assert not is_out_of_time(world.arrays, 1)
    assert step(world.arrays, 3, 2, RNG) == (4, 2.0, True)
    assert reset(world.arrays, RNG) == 2
    assert step(world.arrays, 2, 0, RNG) == (1, -1.0, False)
    assert step(world.arrays, 1, 1, RNG) == (1, -1.0, False)
    assert not is_out_of_time(world.arrays, 2)
    assert step(world.arrays, 1, 0, RNG) == (0, -2.0, False)
    assert is_out_of_time(world.arrays, 3), "the environment truncated"
    assert not must_return(world.arrays)
    assert env.taken == [5, 5, 3, 4, 3]
    reset(world.arrays, RNG)
    assert not is_out_of_time(world.arrays, 0)


def test_a_limit_of_ours_counts_steps() -> None:
    world = world_of(Stairs(), max_episode_steps=2)
    assert not world.problem.is_capped
    reset(world.arrays, RNG)
    assert [bool(is_out_of_time(world.arrays, steps)) for steps in (1, 2, 3)] == [False, True, True]


def test_the_first_world_plays_the_users_environment_and_others_play_copies() -> None:
    env = Stairs()
    problem = GymnasiumProblem(env, "stairs")
    assert problem.world().env is env
    copies = [problem.world().env for _ in range(2)]
    assert all(type(other) is Stairs and other is not env for other in copies)
    made = GymnasiumProblem(env, "stairs", lambda: Stairs())
    assert made.world().env is env
    assert made.world().env is not env


def test_an_error_makes_the_kernel_return_and_is_raised_once() -> None:
    env = Stairs()
    world = world_of(env)
    reset(world.arrays, RNG)
    env.floor = 7
    assert step(world.arrays, 2, 1, RNG)[0] == 0
    assert must_return(world.arrays)
    with pytest.raises(EnvironmentFaultError, match=r"stairs failed \(ObservationError: .*-2 to 2.* in step 1 of epis"):
        world.raise_pending()
    assert not must_return(world.arrays)
    world.raise_pending()
    assert reset(world.arrays, RNG) == 2


def test_when_it_is_late_no_episode_begins() -> None:
    world = world_of(Stairs())
    world.set_deadline(-1.0)
    assert reset(world.arrays, RNG) == 0
    assert must_return(world.arrays)
    assert world.arrays.status[0] == YIELD
    world.raise_pending()
    world.set_deadline(60.0)
    assert reset(world.arrays, RNG) == 2


@pytest.mark.parametrize("answer", [-1, -77, 5 << 2, 2**62])
def test_any_other_number_than_a_state_halts_the_kernel(answer: int) -> None:
    # An error at the callback's door (a signal's handler may raise there) leaves any number as its answer.
    world = world_of(Stairs())
    kept, address = python_callback(lambda _: answer)
    world.arrays = world.arrays._replace(call=address)
    assert step(world.arrays, 2, 0, RNG)[0] == 0
    assert world.arrays.status[0] == FAULT
    with pytest.raises(EnvironmentFaultError, match="was broken off by an error that is printed above in step 1 of"):
        world.raise_pending()
    assert kept is not None


def test_a_callback_gets_and_returns_whole_numbers() -> None:
    kept, address = python_callback(lambda number: number * 3 - 1)
    assert [call_python(address, number) for number in (-1, 0, 2**40)] == [-4, -1, 3 * 2**40 - 1]
    assert kept is not None


def test_masks_are_noted_where_they_are_met() -> None:
    world = world_of(JointEnv(Masked()))
    assert world.problem.has_masks
    assert world.problem.agents == ("first", "second")
    assert world.problem.action_sizes == (3, 3)
    assert reset(world.arrays, RNG) == 0
    assert np.flatnonzero(world.action_masks[0][0]).tolist() == [3, 5, 6, 8]  # first may not take 0, second not 1
    assert world.action_masks[0][1:].all()
    step(world.arrays, 0, 3, RNG)
    assert np.flatnonzero(world.action_masks[0][6]).tolist() == [0, 1, 6, 7]  # both at clock 1: 5 x 1 + 1


def test_masks_that_come_late_are_refused() -> None:
    class Late(Stairs):
        def step(self, action: Any) -> Any:
            return (*super().step(action)[:4], {"action_mask": [1, 1, 0]})

    world = world_of(Late())
    reset(world.arrays, RNG)
    step(world.arrays, 2, 1, RNG)
    with pytest.raises(EnvironmentFaultError, match="must give one in its reset, too") as caught:
        world.raise_pending()
    assert isinstance(caught.value.__cause__, ProblemError)


def test_unequal_agents_are_one_joint_problem() -> None:
    problem = GymnasiumProblem(JointEnv(Unequal()), "unequal")
    assert (problem.n_states, problem.n_actions, problem.action_sizes) == (16, 24, (3, 8))
