"""What kernels read and write of an agent, and how they keep the record of its episodes.

Sizes: S states, A actions, E episodes of one kernel call, K numbers that follow a schedule.
"""

from typing import Any, NamedTuple

from tuckerl._jit import call_python, is_rare, kernel, passed_whole
from tuckerl.generalization.change_log import ChangeLog
from tuckerl.types import BoolArray, FloatArray, IntArray, Stream

ALPHA = 0
"""Where the learning rate stands among the scheduled numbers; the algorithm's own follow, then the policy's."""

AFTER_EPISODE, AT_ONCE = 1, 2
"""When a kernel is to return: at the end of the episode; or at once, and all since the call began is undone."""

_LONGEST_TRAJECTORY = 1_000_000  # steps of the latest episode that are kept
_LOW_BITS = 2**16 - 1  # of a count of steps: where all are set, Python is asked


class Settings(NamedTuple):
    """A learner's numbers that stay the same while it learns."""

    gamma: float
    terminal_discount: float  # 0; or gamma, where terminal states are bootstrapped from, too
    random_ties: bool  # a greedy action is a random one of the maximal actions; otherwise the first of them


class EpisodeRecord(NamedTuple):
    """The episodes of one kernel call: what is to be played, and what came of it."""

    steps: IntArray  # (E,)
    returns: FloatArray  # (E,) undiscounted
    trajectory: IntArray  # (2, T + 1) the states of the two latest episodes in order, as many as fit, by turns
    scheduled: FloatArray  # (E, K) each episode's learning rate and other scheduled numbers
    max_steps: int  # no further episode begins after so many steps
    first: int  # number of the first of these episodes among all of the agent's
    stop: IntArray  # (1,) 0, `AFTER_EPISODE` or `AT_ONCE`, set from outside while the kernel runs
    listen: int  # the address of a Python function that may set `stop`; 0 where another thread does


@passed_whole
class AgentArrays(NamedTuple):
    """One agent, as kernels see it."""

    algorithm: Any  # the algorithm's own NamedTuple: its type selects the algorithm's kernels
    policy: Any  # the policy's own NamedTuple: its type selects the policy's kernels
    q: FloatArray  # (S, A)
    weights: FloatArray  # (A,) omega
    step_sizes: FloatArray  # (A,) alpha omega in the present episode
    scheduled: FloatArray  # (K,) the scheduled numbers in the present episode
    action_mask: BoolArray  # (S, A) True where an action may be taken, or (0, 0) where all may
    settings: Settings
    maxima: Any  # what is known of the rows of q: see `row_maxima`
    log: ChangeLog
    record: EpisodeRecord
    rng: Stream  # (4,) what the agent draws from
    fault: FloatArray  # (4,) what a kernel of a user's own did that is impossible; see `guards`


class Transition(NamedTuple):
    """A step of the environment, as an algorithm learns from it."""

    state: int
    action: int
    reward: float
    discount: float  # of the next state's value: 0 where the return ended
    next_state: int
    ended: bool  # whether the episode ended, with the return or by the time limit


@kernel
def begin_episode(agent: AgentArrays, episode: int) -> None:
    """Set the scheduled numbers of an episode, and the step sizes that follow from them.

    Parameters
    ----------
    agent : AgentArrays
        Its `scheduled` (K,) and `step_sizes` (A,) are set.
    episode : int
        Row of ``agent.record.scheduled``.
    """
    for number in range(agent.scheduled.size):
        agent.scheduled[number] = agent.record.scheduled[episode, number]
    for action in range(agent.step_sizes.size):
        agent.step_sizes[action] = agent.scheduled[ALPHA] * agent.weights[action]


@kernel
def record_state(record: EpisodeRecord, episode: int, step: int, state: int) -> None:
    """Keep the state after `step` steps of an episode, if ``record.trajectory`` (2, T + 1) has room for it."""
    if step < record.trajectory.shape[1]:
        record.trajectory[(record.first + episode) & 1, step] = state


@kernel
def record_episode(record: EpisodeRecord, episode: int, steps: int, total: float) -> None:
    """Keep an episode's steps and return in ``record.steps`` (E,) and ``record.returns`` (E,)."""
    record.steps[episode] = steps
    record.returns[episode] = total


@kernel
def must_stop(record: EpisodeRecord, n_done: int) -> bool:
    """Return whether a kernel that has far to go is to return at once, whatever it leaves behind.

    Parameters
    ----------
    record : EpisodeRecord
    n_done : int
        How many steps, real or planned, the caller has done: now and then Python is asked, so that it hears Ctrl-C.
    """
    if is_rare(n_done & _LOW_BITS == _LOW_BITS) and record.listen != 0:
        call_python(record.listen, 0)
    return is_rare(record.stop[0] == AT_ONCE)


def trajectory_length(max_episode_steps: int | None) -> int:
    """Return how many states of an episode are kept, with such a limit or none."""
    return min(max_episode_steps or _LONGEST_TRAJECTORY, _LONGEST_TRAJECTORY) + 1
