r"""n-step tree backup: n steps learned from off-policy, without importance sampling.

From the last of n steps back to the first,

.. math::
    G \leftarrow r_k + \gamma \sum_{b \ne a_k} \pi(b \mid s_k)\, Q(s_k, b) + \gamma\,\pi(a_k \mid s_k)\, G

where the last G is r + gamma times the mean of Q over pi in the state that was reached. What was done counts as far as
the target policy pi would do it; what pi would have done else counts by its present value. (Precup, Sutton and Singh
2000; Sutton and Barto 2018, section 7.5.)
"""

from typing import Any, Literal, NamedTuple, Unpack

import numpy as np

from tuckerl._jit import kernel
from tuckerl.adapters.resolve import Environment
from tuckerl.checks import check_int, check_name
from tuckerl.generalization.change_log import record_change
from tuckerl.learners.recent_steps import COUNT, MOST_STEPS, PLACE, RecentSteps, keep_step, no_steps
from tuckerl.training.agent_arrays import AgentArrays, Transition
from tuckerl.training.algorithm import register_algorithm
from tuckerl.training.declared_state import Declaration, DeclaredArray, DeclaredRecord
from tuckerl.training.greedy_actions import share_among_greedy
from tuckerl.training.learner import Learner
from tuckerl.training.parameters import LearnerParameters
from tuckerl.training.policies.policy import write_probabilities
from tuckerl.training.row_maxima import change_value
from tuckerl.types import FloatArray


class TreeBackupState(NamedTuple):
    """The steps that are waited for, and room for the target policy's probabilities."""

    steps: RecentSteps  # N = n
    probabilities: FloatArray  # (A,) overwritten
    is_greedy: bool  # the target policy; otherwise it is the one that the agent acts by


@kernel
def _value_beside(algorithm: TreeBackupState, agent: AgentArrays, state: int, taken: int) -> float:
    """Return the sum of pi(b | s) Q(s, b) over all actions but the one `taken`, and leave pi in `probabilities`."""
    probabilities, value = algorithm.probabilities, 0.0
    if algorithm.is_greedy:
        probabilities[:] = 0.0
        share_among_greedy(agent, state, 1.0, probabilities)
    else:
        write_probabilities(agent.policy, agent, state, probabilities)
    for action in range(probabilities.size):
        if action != taken:
            value += probabilities[action] * agent.q[state, action]
    return value


@kernel
def _target(algorithm: TreeBackupState, agent: AgentArrays, transition: Transition, place: int, n_steps: int) -> float:
    """Return what `n_steps` steps are worth, the transition's being the last of them and kept at `place`."""
    steps, gamma = algorithm.steps, agent.settings.gamma
    target = transition.reward + transition.discount * _value_beside(algorithm, agent, transition.next_state, -1)
    for _ in range(n_steps - 1):
        step = steps.ring[place]
        state, action = step["state"], step["action"]
        beside = _value_beside(algorithm, agent, state, action)
        place = place - 1 if place > 0 else steps.ring.size - 1
        before = steps.ring[place]
        target = before["reward"] + gamma * (beside + algorithm.probabilities[action] * target)
    return target


@kernel
def update(algorithm: TreeBackupState, agent: AgentArrays, transition: Transition, next_action: int) -> bool:
    """Learn from the step of n steps ago, and at an end from all that are left; ``agent.q`` (S, A) changes."""
    steps, q, n = algorithm.steps, agent.q, algorithm.steps.ring.size
    place, n_steps, total = keep_step(steps, transition), min(int(steps.cursor[COUNT]) + 1, n), 0.0
    steps.cursor[PLACE], steps.cursor[COUNT] = (place + 1) % n, n_steps
    fewest = 1 if transition.ended else n
    while n_steps >= fewest:
        target = _target(algorithm, agent, transition, place, n_steps)
        step = steps.ring[(place + 1 - n_steps) % n]
        state, action = step["state"], step["action"]
        record_change(agent.log, state)
        value = q[state, action]
        value += agent.step_sizes[action] * (target - value)
        change_value(agent, state, action, value)
        total += value
        n_steps -= 1
    if transition.ended:
        steps.cursor[PLACE], steps.cursor[COUNT] = 0, 0
    return np.isfinite(total)


register_algorithm(TreeBackupState, update=update, on_policy=True, keeps_maxima=True)


class TreeBackup(Learner):
    """n-step tree backup for one agent or several, each in its own copy of the problem.

    Parameters
    ----------
    env
        As for every :class:`~tuckerl.training.learner.Learner`, whose other parameters hold too.
    n : int
        How many steps an update looks ahead, from 1 to a million. Its work grows with n times the number of actions.
    target : "greedy" or "policy"
        The policy that is learned about: the greedy one, with which n=1 is Q-learning; or the one that the agent acts
        by, with which n=1 is Expected SARSA.

    Raises
    ------
    ParameterError, ParameterTypeError, UnknownNameError
        If `n` is not such a number, or `target` no such name.

    References
    ----------
    Precup, Sutton and Singh, ICML 2000; Sutton and Barto, *Reinforcement Learning*, 2018, section 7.5.

    Examples
    --------
    >>> import tuckerl
    >>> agent = tuckerl.TreeBackup(tuckerl.sutton_maze(), n=8, alpha=0.5, seed=0).learn(episodes=50)
    >>> agent.steps.shape
    (50, 1)
    """

    state_type = TreeBackupState

    def __init__(
        self,
        env: Environment,
        *,
        n: int = 4,
        target: Literal["greedy", "policy"] = "greedy",
        **parameters: Unpack[LearnerParameters],
    ) -> None:
        self.n = check_int("n", n, 1, MOST_STEPS)
        self.target = check_name("target", target, ("greedy", "policy"))
        super().__init__(env, **parameters)

    def declare_state(self) -> tuple[Declaration, ...]:
        """Return the steps that are waited for, of which none is left between two episodes, and room."""
        n = min(self.n, self.problem.max_episode_steps or self.n)  # no episode has more
        return (
            DeclaredRecord("steps", "none", lambda n_states, n_actions: no_steps(n)),
            DeclaredArray("probabilities", "none", ("actions",)),
        )

    def constants(self) -> dict[str, Any]:
        """Return which policy is learned about."""
        return {"is_greedy": self.target == "greedy"}
