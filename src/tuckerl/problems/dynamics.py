"""How a kernel plays a problem: begin an episode, take a step."""

from tuckerl._jit import kernel
from tuckerl.problems.mdp import MDPArrays
from tuckerl.rng import uniform
from tuckerl.types import FloatArray, Stream


@kernel
def _first_above(cumulative: FloatArray, low: int, high: int, rng: Stream) -> int:
    """Draw an index from `low` to `high` - 1 by summed probabilities."""
    u = uniform(rng)
    while low < high - 1 and u >= cumulative[low]:
        low += 1
    return low


@kernel
def reset(problem: MDPArrays, rng: Stream) -> int:
    """Return the first state of an episode."""
    if problem.start_state.size == 1:
        return problem.start_state[0]
    return problem.start_state[_first_above(problem.start_cumulative, 0, problem.start_state.size, rng)]


@kernel
def step(problem: MDPArrays, state: int, action: int, rng: Stream) -> tuple[int, float, bool]:
    """Return the next state, the reward and whether the return ends there."""
    outcome = state * problem.n_actions + action
    if problem.offsets.size > 0:
        low, high = problem.offsets[outcome], problem.offsets[outcome + 1]
        outcome = low if high == low + 1 else _first_above(problem.cumulative, low, high, rng)
    return problem.next_state[outcome], problem.reward[outcome], problem.terminated[outcome]
