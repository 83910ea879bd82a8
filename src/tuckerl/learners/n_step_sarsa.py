r"""n-step SARSA: an entry moves towards n rewards and the value of the pair that comes after them.

.. math::
    G = \sum_{k=1}^{n} \gamma^{k-1} r_{t+k} + \gamma^n Q(s_{t+n}, a_{t+n}), \qquad
    Q(s_t, a_t) \leftarrow Q(s_t, a_t) + \alpha\,\omega(a_t) [G - Q(s_t, a_t)]

n steps later; at the end of an episode, for all pairs that are left. (Sutton and Barto 2018, section 7.2.)

The sum costs the same for every n. Steps come in blocks of n, a slot of a ring for each. Where a block ends, its
rewards are summed from each slot to the block's end; those of the next block are summed as they come. The n rewards
since a slot are the one sum and, discounted, the other.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple, Unpack

import numpy as np

from tuckerl._jit import kernel
from tuckerl.adapters.resolve import Environment
from tuckerl.checks import check_int
from tuckerl.errors import SavedFileError
from tuckerl.generalization.change_log import record_change
from tuckerl.learners.recent_steps import COUNT, MOST_STEPS, PLACE, RecentSteps, keep_step, no_steps
from tuckerl.training.agent_arrays import AgentArrays, Transition
from tuckerl.training.algorithm import register_algorithm
from tuckerl.training.declared_state import Declaration, DeclaredArray, DeclaredRecord
from tuckerl.training.learner import Learner
from tuckerl.training.parameters import LearnerParameters
from tuckerl.training.row_maxima import change_value
from tuckerl.types import FloatArray


class NStepSarsaState(NamedTuple):
    """The steps that are waited for, and sums of their rewards."""

    steps: RecentSteps  # N = n; their `reward`: of the block before, the discounted sums from each to the block's end
    block: FloatArray  # (1,) the discounted sum of the present block's rewards
    powers: FloatArray  # (N + 1,) gamma to the power of 0 to N


@kernel
def _move(agent: AgentArrays, step: Any, target: float) -> float:
    """Move the value in ``agent.q`` (S, A) of a step's pair towards a target, and return it."""
    state, action = step["state"], step["action"]
    record_change(agent.log, state)
    value = agent.q[state, action]
    value += agent.step_sizes[action] * (target - value)
    change_value(agent, state, action, value)
    return value


@kernel
def update(algorithm: NStepSarsaState, agent: AgentArrays, transition: Transition, next_action: int) -> bool:
    """Learn from the step of n steps ago, and at an end from all that are left; ``agent.q`` (S, A) changes."""
    steps, powers = algorithm.steps, algorithm.powers
    n, place, total = steps.ring.size, keep_step(steps, transition), 0.0
    block = algorithm.block[0] + powers[np.uint32(place)] * transition.reward
    place += 1
    count = min(int(steps.cursor[COUNT]) + 1, n)
    algorithm.block[0], steps.cursor[PLACE], steps.cursor[COUNT] = block, place, count
    after = transition.discount * agent.q[transition.next_state, np.uint32(next_action)]
    if count == n:
        step = steps.ring[np.uint32(place if place < n else 0)]  # of a full block, all is in its own sum
        rewards = powers[np.uint32(n - place)] * block + (step["reward"] if place < n else 0.0)
        total = _move(agent, step, rewards + powers[np.uint32(n - 1)] * after)
    if place == n or transition.ended:
        _end_block(algorithm, agent.settings.gamma)
    if transition.ended:
        total += _learn_the_rest(algorithm, agent, transition, next_action)
    return np.isfinite(total)


@kernel
def _end_block(algorithm: NStepSarsaState, gamma: float) -> None:
    """Sum the present block's rewards from each of its slots to its end, and begin another one if it is full."""
    steps, later = algorithm.steps, 0.0
    for place in range(int(steps.cursor[PLACE]) - 1, -1, -1):
        step = steps.ring[np.uint32(place)]
        later = step["reward"] + gamma * later
        step["reward"] = later
    if steps.cursor[PLACE] == steps.ring.size:
        steps.cursor[PLACE], algorithm.block[0] = 0, 0.0


@kernel
def _learn_the_rest(algorithm: NStepSarsaState, agent: AgentArrays, transition: Transition, next_action: int) -> float:
    """Learn from the steps that fewer than n steps have followed, the first one first, and return the values' sum."""
    steps, powers, n, total = algorithm.steps, algorithm.powers, algorithm.steps.ring.size, 0.0
    n_steps = min(int(steps.cursor[COUNT]), n - 1)
    while n_steps > 0:
        place, rewards = int(steps.cursor[PLACE]) - n_steps, 0.0
        if place < 0:  # in the block before, whose sums end where the present one's begins
            rewards = powers[-place] * algorithm.block[0]
            place += n
        step = steps.ring[place]
        after = transition.discount * agent.q[transition.next_state, next_action]  # which may have just changed
        total += _move(agent, step, rewards + step["reward"] + powers[n_steps - 1] * after)
        n_steps -= 1
    steps.cursor[PLACE], steps.cursor[COUNT], algorithm.block[0] = 0, 0, 0.0
    return total


register_algorithm(NStepSarsaState, update=update, on_policy=True, keeps_maxima=True)


class NStepSarsa(Learner):
    """n-step SARSA for one agent or several, each in its own copy of the problem.

    Parameters
    ----------
    env
        As for every :class:`~tuckerl.training.learner.Learner`, whose other parameters hold too.
    n : int
        How many rewards an update looks ahead: from 1, which is SARSA, to a million. As many as an episode has steps
        are a Monte Carlo method.

    Raises
    ------
    ParameterError, ParameterTypeError
        If `n` is not such a number.

    References
    ----------
    Sutton and Barto, *Reinforcement Learning*, 2018, section 7.2; Watkins, *Learning from Delayed Rewards*, 1989.

    Examples
    --------
    >>> import tuckerl
    >>> agent = tuckerl.NStepSarsa(tuckerl.sutton_maze(), n=8, alpha=0.2, seed=0).learn(episodes=50)
    >>> agent.steps.shape
    (50, 1)
    """

    state_type = NStepSarsaState

    def __init__(self, env: Environment, *, n: int = 4, **parameters: Unpack[LearnerParameters]) -> None:
        self.n = check_int("n", n, 1, MOST_STEPS)
        super().__init__(env, **parameters)
        self._powers = self.gamma ** np.arange(self._n_waited_for() + 1)  # once: of a large n, they take long

    def declare_state(self) -> tuple[Declaration, ...]:
        """Return the steps that are waited for, of which none is left between two episodes."""
        n = self._n_waited_for()
        return (
            DeclaredRecord("steps", "none", lambda n_states, n_actions: no_steps(n)),
            DeclaredArray("block", "none", (1,)),
        )

    def check_declared(self, declared: Mapping[str, Any]) -> None:
        """Refuse a sum of a file that would be added to the next episode's rewards."""
        if not declared["block"][0] == 0.0:  # nor NaN
            raise SavedFileError("no step waits between two episodes, so that the sum of their rewards must be 0")

    def constants(self) -> dict[str, Any]:
        """Return the powers of gamma."""
        return {"powers": self._powers}

    def _n_waited_for(self) -> int:
        """Return `n`, or fewer steps where no episode has so many: this comes to the same."""
        return min(self.n, self.problem.max_episode_steps or self.n)
