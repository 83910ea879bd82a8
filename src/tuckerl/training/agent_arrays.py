"""What kernels know of an agent, and how they keep account of its episodes."""

from typing import Any, NamedTuple

from tuckerl._jit import kernel
from tuckerl.generalization.change_log import ChangeLog
from tuckerl.types import BoolArray, FloatArray, IntArray, Stream


class Settings(NamedTuple):
    """A learner's numbers, as kernels read them."""

    gamma: float
    terminal_discount: float  # 0; or gamma, where values are bootstrapped from terminal states, too
    random_ties: bool  # among maximal actions; otherwise the first


class Record(NamedTuple):
    """What is asked of a kernel for E episodes, and what it writes down about them."""

    steps: IntArray  # (E,)
    returns: FloatArray  # (E,) undiscounted
    trajectory: IntArray  # (T + 1,) the states of the latest episode in order; as many as fit
    alpha: FloatArray  # (E,) each episode's learning rate
    epsilon: FloatArray  # (E,) each episode's probability of a random action
    enough: int  # steps after which no further episode begins


class Agent(NamedTuple):
    """One agent, as kernels read it."""

    method: Any  # the algorithm's own NamedTuple: its type says which algorithm it is
    q: FloatArray  # (S, A)
    weights: FloatArray  # (A,) omega
    step_sizes: FloatArray  # (A,) alpha omega in the present episode
    action_mask: BoolArray  # (S, A) True where an action may be taken, or (0, 0) where all may
    settings: Settings
    log: ChangeLog
    record: Record
    rng: Stream


class Transition(NamedTuple):
    """A step, as an algorithm learns from it."""

    state: int
    action: int
    reward: float
    discount: float  # of the next state's value: 0 where the return ended
    next_state: int
    ended: bool  # whether the episode ended, with the return or by the time limit


@kernel
def set_step_sizes(agent: Agent, episode: int) -> None:
    """Multiply the episode's learning rate by the action weights."""
    for action in range(agent.step_sizes.size):
        agent.step_sizes[action] = agent.record.alpha[episode] * agent.weights[action]


@kernel
def note_state(record: Record, step: int, state: int) -> None:
    """Keep the state reached after `step` steps of this episode."""
    if step < record.trajectory.size:
        record.trajectory[step] = state


@kernel
def note_episode(record: Record, episode: int, steps: int, total: float) -> None:
    """Keep an episode's steps and return."""
    record.steps[episode] = steps
    record.returns[episode] = total
