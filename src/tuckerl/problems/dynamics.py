"""How a kernel plays a problem, whatever its kind: begin an episode, take a step."""

import numpy as np

from tuckerl._jit import by_kind, kernel
from tuckerl.problems.mdp import MDPArrays
from tuckerl.problems.simulator import (
    ACTION,
    FROM_STATE,
    KIND,
    NOT_FINITE,
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
    total = reward
    for number in world.state:
        total += number - number  # 0 for a finite number, NaN for any other
    return np.isfinite(total)


@kernel
def _checked_index(world: SimulatorArrays, state: int, action: int, reward: float) -> int:
    """Return the state's row; what is impossible goes into `fault`, for Python to raise, and reads as row 0."""
    index = world.index(world.parameters, world.state)
    within = 0 <= index < world.n_states
    if within and _finite(world, reward):
        return index
    fault = world.fault
    if fault[KIND] == 0:
        fault[KIND] = OUT_OF_RANGE if not within else NOT_FINITE
        fault[FROM_STATE], fault[ACTION], fault[STEP] = state, action, world.clock[0]
        fault[TO_STATE], fault[REWARD] = index, reward
    return 0


@kernel
def _reset_simulator(world: SimulatorArrays, rng: Stream) -> int:
    world.clock[0] = 0
    world.reset(world.parameters, world.state, rng)
    return _checked_index(world, 0, 0, 0.0)


@kernel
def _step_simulator(world: SimulatorArrays, state: int, action: int, rng: Stream) -> tuple[int, float, bool]:
    world.clock[0] += 1
    reward, terminated = world.step(world.parameters, world.state, action, rng)
    next_state = _checked_index(world, state, action, reward)
    return next_state, reward, terminated or world.fault[KIND] > 0


reset = by_kind({MDPArrays: _reset_table, SimulatorArrays: _reset_simulator})
"""``reset(world, rng)`` returns the first state of an episode."""

step = by_kind({MDPArrays: _step_table, SimulatorArrays: _step_simulator})
"""``step(world, state, action, rng)`` returns the next state, the reward and whether the return ends there."""
