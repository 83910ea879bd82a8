"""How a kernel plays a problem, whatever its kind: begin an episode, take a step."""

from tuckerl._jit import by_kind, kernel
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

World = MDPArrays | SimulatorArrays
"""What kernels read of a problem."""


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


reset = by_kind({MDPArrays: _reset_table, SimulatorArrays: _reset_simulator})
"""``reset(world, rng)`` returns the first state of an episode."""

step = by_kind({MDPArrays: _step_table, SimulatorArrays: _step_simulator})
"""``step(world, state, action, rng)`` returns the next state, the reward and whether the return ends there."""
