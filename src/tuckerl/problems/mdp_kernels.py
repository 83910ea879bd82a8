"""How kernels play a finite MDP by its arrays."""

from tuckerl._jit import kernel
from tuckerl.problems.dynamics import register_dynamics
from tuckerl.problems.mdp import MDPArrays
from tuckerl.rng import uniform
from tuckerl.types import FloatArray, Stream

_FEW = 32  # so many are looked at one after the other: halving them takes longer


@kernel
def _reset(world: MDPArrays, rng: Stream) -> int:
    """Return the first state of an episode.

    Parameters
    ----------
    world : MDPArrays
    rng : (4,) uint64
        The agent's stream; advanced where there are several first states.
    """
    if world.start_state.size == 1:
        return world.start_state[0]
    return world.start_state[draw_outcome(world.start_cumulative, 0, world.start_state.size, rng)]


@kernel
def _step(world: MDPArrays, state: int, action: int, rng: Stream) -> tuple[int, float, bool]:
    """Return the next state, the reward, and whether the return ends there.

    Parameters
    ----------
    world : MDPArrays
    state, action : int
    rng : (4,) uint64
        The agent's stream; advanced where the pair has several outcomes.
    """
    number = state * world.n_actions + action
    if world.offsets.size > 0:
        low, high = world.offsets[number], world.offsets[number + 1]
        number = low if high == low + 1 else draw_outcome(world.cumulative, low, high, rng)
    outcome = world.outcomes[number]  # by name in brackets, so that it works uncompiled, too
    return outcome["next_state"], outcome["reward"], outcome["terminated"]


@kernel
def draw_outcome(cumulative: FloatArray, low: int, high: int, rng: Stream) -> int:
    """Draw one of the outcomes from `low` to `high` - 1.

    Parameters
    ----------
    cumulative : (M,) float64
        The summed probabilities of each pair's outcomes, or of all first states.
    low, high : int
    rng : (4,) uint64
        The agent's stream; advanced by one draw.
    """
    u = uniform(rng)
    if high - low <= _FEW:
        while low < high - 1 and u >= cumulative[low]:
            low += 1
        return low
    while high - low > 1:  # the first whose sum lies above u is among them
        middle = (low + high) // 2
        if u < cumulative[middle - 1]:
            high = middle
        else:
            low = middle
    return low


register_dynamics(MDPArrays, reset=_reset, step=_step)
