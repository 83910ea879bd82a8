r"""R-learning: off-policy control for the largest average reward a step, without a discount.

.. math::
    Q(s, a) &\leftarrow Q(s, a) + \alpha\,\omega(a) [r - \rho + \max_b Q(s', b) - Q(s, a)] \\
    \rho &\leftarrow \rho + \beta [r - \rho + \max_b Q(s', b) - \max_b Q(s, b)] \quad \text{if } a \text{ is greedy}

rho is the average reward, and Q says how much better than that a pair is in the long run: values are relative.
(Schwartz 1993; Mahadevan 1996; Sutton and Barto 1998, section 6.7, whose box this is.)

What never ends has an average. So an end leads to the next start: the last step of an episode is learned from when the
next one begins, as only then is known where it led. A step that was cut off leads to where it led.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple, Unpack

import numpy as np

from tuckerl._jit import kernel
from tuckerl.adapters.resolve import Environment
from tuckerl.checks import check_real
from tuckerl.errors import ParameterError, SavedFileError
from tuckerl.generalization.change_log import record_change
from tuckerl.training.agent_arrays import AgentArrays, Transition
from tuckerl.training.algorithm import NOT_FINITE, register_algorithm
from tuckerl.training.declared_state import Declaration, DeclaredArray
from tuckerl.training.greedy_actions import greedy_value
from tuckerl.training.learner import Learner
from tuckerl.training.parameters import LearnerParameters
from tuckerl.training.policies.policy import choose
from tuckerl.training.row_maxima import change_value
from tuckerl.training.schedules import Schedule, as_number, as_schedule
from tuckerl.types import FloatArray, IntArray


class RLearningState(NamedTuple):
    """The average reward, and the last step of an episode until it is known where the next one begins."""

    rho: FloatArray  # (1,)
    waits: IntArray  # (1,) 1 where a last step waits, else 0; then what follows has a meaning
    state: IntArray  # (1,)
    action: IntArray  # (1,)
    reward: FloatArray  # (1,)
    scheduled: FloatArray  # (1,) beta in the present episode


@kernel
def learn(algorithm: RLearningState, agent: AgentArrays, state: int, action: int, reward: float, then: int) -> bool:
    """Learn from a step that led to the state `then`.

    Parameters
    ----------
    algorithm : RLearningState
        Its `rho` (1,) changes if the action is greedy.
    agent : AgentArrays
        Its `q` (S, A) changes at the pair.
    """
    record_change(agent.log, state)
    rho, value = algorithm.rho[0], agent.q[state, action]
    value += agent.step_sizes[action] * (reward - rho + greedy_value(agent, then) - value)
    change_value(agent, state, action, value)
    best = greedy_value(agent, state)
    if value == best:
        rho += algorithm.scheduled[0] * (reward - rho + greedy_value(agent, then) - best)
        algorithm.rho[0] = rho
    return np.isfinite(value) and np.isfinite(rho)


@kernel
def act(algorithm: RLearningState, agent: AgentArrays, state: int) -> int:
    """Choose an action, after the latest episode's last step has been learned from; ``agent.q`` (S, A) changes then."""
    if algorithm.waits[0] != 0:
        algorithm.waits[0] = 0
        if not learn(algorithm, agent, algorithm.state[0], algorithm.action[0], algorithm.reward[0], state):
            return NOT_FINITE
    return choose(agent.policy, agent, state)


@kernel
def update(algorithm: RLearningState, agent: AgentArrays, transition: Transition, next_action: int) -> bool:
    """Learn from a step, or keep one that ended the return; ``agent.q`` (S, A) changes at its state and action."""
    state, action, reward, discount, next_state, _ = transition
    if discount > 0.0:
        return learn(algorithm, agent, state, action, reward, next_state)
    algorithm.waits[0] = 1
    algorithm.state[0], algorithm.action[0], algorithm.reward[0] = state, action, reward
    return True


register_algorithm(RLearningState, act=act, update=update, keeps_maxima=True)


class RLearning(Learner):
    """R-learning for one agent or several, each in its own copy of the problem.

    Parameters
    ----------
    env
        As for every :class:`~tuckerl.training.learner.Learner`, whose other parameters hold too.
    beta : float in (0, 1] or Schedule
        The step size of the average reward; a tensor step does not weight it.
    gamma : float
        1, and nothing else: there is no discount.

    Raises
    ------
    ParameterError
        If `gamma` is not 1.

    References
    ----------
    Schwartz, *A reinforcement learning method for maximizing undiscounted rewards*, ICML 1993; Mahadevan, Machine
    Learning 22, 1996; Sutton and Barto, *Reinforcement Learning*, first edition 1998, section 6.7.

    Examples
    --------
    >>> import tuckerl
    >>> agent = tuckerl.RLearning(tuckerl.sutton_maze(), alpha=0.5, seed=0).learn(episodes=200)
    >>> agent.rho.shape
    (1,)
    """

    state_type = RLearningState

    def __init__(  # type: ignore[misc]  # gamma is one of the parameters of all learners, where it may be below 1
        self,
        env: Environment,
        *,
        beta: float | Schedule = 0.01,
        gamma: float = 1.0,
        **parameters: Unpack[LearnerParameters],
    ) -> None:
        self._beta = as_schedule("beta", beta, positive=True)
        self.beta = as_number(beta)
        if check_real("gamma", gamma, 0.0, 1.0) != 1.0:
            raise ParameterError(
                f"gamma of RLearning must be 1, as it maximises the average reward and has no discount; got {gamma:g}: "
                "leave gamma out, or use QLearning for discounted returns"
            )
        super().__init__(env, gamma=1.0, **parameters)

    @property
    def rho(self) -> FloatArray:
        """Each agent's estimate of the average reward a step, (n_agents,), a copy."""
        return np.array([held["rho"][0] for held in self.declared])

    def declare_state(self) -> tuple[Declaration, ...]:
        """Return the average reward, which is shared as the tables are, and the step that waits."""
        return (
            DeclaredArray("rho", "by_entry", (1,)),
            DeclaredArray("end.waits", "none", (1,), np.int64, bounds=(0, 1)),
            DeclaredArray("end.state", "none", (1,), np.int64, bounds="states"),
            DeclaredArray("end.action", "none", (1,), np.int64, bounds="actions"),
            DeclaredArray("end.reward", "none", (1,)),
        )

    def check_declared(self, declared: Mapping[str, Any]) -> None:
        """Refuse an average or a reward of a file that is not finite."""
        if not (np.isfinite(declared["rho"]).all() and np.isfinite(declared["end.reward"]).all()):
            raise SavedFileError("the average reward of R-learning, and the reward that waits, must be finite")

    def algorithm_schedules(self) -> dict[str, Schedule]:
        """Return the schedule of the average reward's step size."""
        return {"beta": self._beta}
