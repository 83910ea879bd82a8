"""How a kernel plays a problem, whatever its kind: begin an episode, take a step."""

from tuckerl._jit import by_kind, call_python, kernel
from tuckerl.adapters.gymnasium_problem import BEGIN_EPISODE, STATE_SHIFT, GymnasiumArrays
from tuckerl.adapters.pettingzoo_problem import PettingZooArrays
from tuckerl.adapters.python_world import FAULT, REWARD_IS_NOT_FINITE, TERMINATED, TRUNCATED, YIELD
from tuckerl.problems.mdp import MDPArrays
from tuckerl.problems.simulator import (
    ACTION,
    FROM_STATE,
    KIND,
    NOT_FINITE,
    NUMBERS,
    OUT_OF_RANGE,
    REWARD,
    STEP,
    TO_STATE,
    SimulatorArrays,
)
from tuckerl.rng import uniform
from tuckerl.types import FloatArray, Stream

WorldArrays = MDPArrays | SimulatorArrays | GymnasiumArrays
"""What kernels read of a problem that one agent plays."""


@kernel
def _first_above(cumulative: FloatArray, low: int, high: int, rng: Stream) -> int:
    """Draw an index from `low` to `high` - 1 by summed probabilities."""
    u = uniform(rng)
    while low < high - 1 and u >= cumulative[low]:
        low += 1
    return low


@kernel
def _reset_table(world: MDPArrays, rng: Stream) -> int:
    if world.start_state.size == 1:
        return world.start_state[0]
    return world.start_state[_first_above(world.start_cumulative, 0, world.start_state.size, rng)]


@kernel
def _step_table(world: MDPArrays, state: int, action: int, rng: Stream) -> tuple[int, float, bool]:
    outcome = state * world.n_actions + action
    if world.offsets.size > 0:
        low, high = world.offsets[outcome], world.offsets[outcome + 1]
        outcome = low if high == low + 1 else _first_above(world.cumulative, low, high, rng)
    return world.next_state[outcome], world.reward[outcome], world.terminated[outcome]


@kernel
def _finite(world: SimulatorArrays, reward: float) -> bool:
    total = reward - reward  # 0 for a finite number, NaN for any other
    for number in world.state:
        total += number - number
    return total == 0.0


@kernel
def _note_fault(world: SimulatorArrays, kind: float, state: int, action: int, reward: float, index: int) -> None:
    """Keep the first impossible thing for Python to raise."""
    fault = world.fault
    if fault[KIND] == 0.0:
        fault[KIND], fault[FROM_STATE], fault[ACTION], fault[STEP] = kind, state, action, world.clock[0]
        fault[TO_STATE], fault[REWARD] = index, reward
        for i in range(world.state.size):
            fault[NUMBERS + i] = world.state[i]


@kernel
def _row(world: SimulatorArrays, state: int, action: int, reward: float) -> int:
    """Return the state's row, or -1 where a number is not finite or the row is none."""
    if not _finite(world, reward):
        _note_fault(world, NOT_FINITE, state, action, reward, -1)
        return -1
    index = world.index(world.parameters, world.state)
    if 0 <= index < world.n_states:
        return index
    _note_fault(world, OUT_OF_RANGE, state, action, reward, index)
    return -1


@kernel
def _reset_simulator(world: SimulatorArrays, rng: Stream) -> int:
    world.clock[0] = 0.0
    world.reset(world.parameters, world.state, rng)
    return max(_row(world, 0, 0, 0.0), 0)


@kernel
def _step_simulator(world: SimulatorArrays, state: int, action: int, rng: Stream) -> tuple[int, float, bool]:
    world.clock[0] += 1.0
    reward, terminated = world.step(world.parameters, world.state, action, rng)
    next_state = _row(world, state, action, reward)
    if next_state < 0 or world.fault[KIND] > 0.0:  # end every episode at once: there may be no time limit
        return 0, 0.0, True
    return next_state, reward, terminated


@kernel
def _state_in(world: GymnasiumArrays, code: int) -> int:
    """Return the state in a callback's answer; 0 if that is an error's number, or what an uncaught error left there."""
    state = code >> STATE_SHIFT
    if 0 <= state < world.n_states:
        world.status[0] = 0
        return state
    world.status[0] = YIELD if code == YIELD else FAULT
    return 0


@kernel
def _reset_stepped(world: GymnasiumArrays, rng: Stream) -> int:
    world.clock[0] = 0.0
    return _state_in(world, call_python(world.call, BEGIN_EPISODE))


@kernel
def _step_stepped(world: GymnasiumArrays, state: int, action: int, rng: Stream) -> tuple[int, float, bool]:
    world.clock[0] += 1.0
    code = call_python(world.call, action)
    state, reward = _state_in(world, code), world.reward[0]
    if world.status[0] == 0 and reward - reward != 0.0:  # 0 for a finite number, NaN for any other
        world.status[0] = REWARD_IS_NOT_FINITE
    world.truncated[0] = code & TRUNCATED > 0
    return state, reward, code & TERMINATED > 0


@kernel
def _table_is_late(world: MDPArrays, steps: int) -> bool:
    return steps >= world.max_episode_steps


@kernel
def _simulator_is_late(world: SimulatorArrays, steps: int) -> bool:
    return steps >= world.max_episode_steps


@kernel
def _stepped_is_late(world: GymnasiumArrays, steps: int) -> bool:
    return world.truncated[0] or steps >= world.max_episode_steps


@kernel
def _table_goes_on(world: MDPArrays) -> bool:
    return False


@kernel
def _simulator_halted(world: SimulatorArrays) -> bool:
    return world.fault[KIND] > 0.0


@kernel
def _stepped_halted(world: GymnasiumArrays) -> bool:
    return world.status[0] < 0


@kernel
def _players_halted(world: PettingZooArrays) -> bool:
    return world.status[0] < 0


reset = by_kind({MDPArrays: _reset_table, SimulatorArrays: _reset_simulator, GymnasiumArrays: _reset_stepped})
"""``reset(world, rng)`` returns the first state of an episode."""

step = by_kind({MDPArrays: _step_table, SimulatorArrays: _step_simulator, GymnasiumArrays: _step_stepped})
"""``step(world, state, action, rng)`` returns the next state, the reward and whether the return ends there."""

out_of_time = by_kind(
    {MDPArrays: _table_is_late, SimulatorArrays: _simulator_is_late, GymnasiumArrays: _stepped_is_late}
)
"""``out_of_time(world, steps)`` returns whether the episode is truncated after so many steps."""

halted = by_kind(
    {
        MDPArrays: _table_goes_on,
        SimulatorArrays: _simulator_halted,
        GymnasiumArrays: _stepped_halted,
        PettingZooArrays: _players_halted,
    }
)
"""``halted(world)`` returns whether the kernel must return: something is wrong, or Python wants to be asked first."""
