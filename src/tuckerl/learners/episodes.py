"""What all kernels share: choosing actions, and keeping account of an episode."""

from typing import NamedTuple

from tuckerl._jit import kernel
from tuckerl.rng import below, uniform
from tuckerl.types import FloatArray, IntArray, Stream


class Settings(NamedTuple):
    """A learner's numbers, as kernels read them."""

    gamma: float
    epsilon_decay: float
    terminal_discount: float  # 0; or gamma, where values are bootstrapped from terminal states, too
    random_ties: bool  # among maximal actions; otherwise the first


class Record(NamedTuple):
    """What a kernel writes down about the E episodes that it plays."""

    steps: IntArray  # (E,)
    returns: FloatArray  # (E,) undiscounted
    trajectory: IntArray  # (T + 1,) the states of the latest episode in order; as many as fit
    epsilon: FloatArray  # (1,) the probability of a random action, decayed after each episode


@kernel
def row_max(table: FloatArray, row: int) -> float:
    """Return the largest entry of a row."""
    best = table[row, 0]
    for column in range(1, table.shape[1]):
        best = max(best, table[row, column])
    return best


@kernel
def maxima(table: FloatArray, row: int) -> tuple[int, int]:
    """Return the first column of a row's largest entry, and in how many columns that entry stands."""
    # Two passes without a branch that depends on the values: twice as fast as one pass that mispredicts.
    best = row_max(table, row)
    first, ties = 0, 0
    for column in range(table.shape[1] - 1, -1, -1):
        if table[row, column] == best:
            first = column
            ties += 1
    return first, ties


@kernel
def random_maximum(table: FloatArray, row: int, first: int, ties: int, rng: Stream) -> int:
    """Draw one of the columns that `maxima` counted."""
    if ties == 1:
        return first
    skip = below(ties, rng)
    column = first
    while skip > 0:
        column += 1
        if table[row, column] == table[row, first]:
            skip -= 1
    return column


@kernel
def greedy(table: FloatArray, row: int, random_ties: bool, rng: Stream) -> int:
    """Return the column of a row's largest entry."""
    first, ties = maxima(table, row)
    return random_maximum(table, row, first, ties, rng) if random_ties else first


@kernel
def epsilon_greedy(q: FloatArray, state: int, epsilon: float, random_ties: bool, rng: Stream) -> int:
    """Return a random action with probability epsilon, else a greedy one."""
    if uniform(rng) < epsilon:
        return below(q.shape[1], rng)
    return greedy(q, state, random_ties, rng)


@kernel
def note_state(record: Record, step: int, state: int) -> None:
    """Keep the state reached after `step` steps of this episode."""
    if step < record.trajectory.size:
        record.trajectory[step] = state


@kernel
def note_episode(record: Record, settings: Settings, episode: int, steps: int, total: float) -> None:
    """Keep an episode's steps and return, and decay epsilon."""
    record.steps[episode] = steps
    record.returns[episode] = total
    record.epsilon[0] *= settings.epsilon_decay
