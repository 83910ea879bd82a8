r"""Prioritized sweeping: planning where values are about to change most, and from there backwards.

A queue holds the pairs whose update would change their value by more than theta, by how much it would,

.. math:: P(s, a) = |r + \gamma \max_b Q(s', b) - Q(s, a)|

with r and s' the pair's latest outcome. After each real step, up to n times, the first pair is updated, and the pairs
that lead to its state are looked at. The model is the book's deterministic one. (Moore and Atkeson 1993; Peng and
Williams 1993; Sutton and Barto 2018, section 8.4.)
"""

from collections.abc import Mapping
from typing import Any, NamedTuple, Unpack

import numpy as np
from numpy.typing import NDArray

from tuckerl._jit import kernel
from tuckerl.adapters.resolve import Environment
from tuckerl.checks import check_int, check_real
from tuckerl.errors import SavedFileError
from tuckerl.generalization.change_log import keep_row, record_change
from tuckerl.learners.latest_outcomes import OUTCOME, check_outcomes, keep_outcome, revised_discounts
from tuckerl.learners.predecessors import Predecessors, check_lists, link_all, move
from tuckerl.learners.priority_queue import PriorityQueue, empty_queue, insert, take_first
from tuckerl.learners.q_learning import move_towards_target
from tuckerl.training.agent_arrays import AgentArrays, Settings, Transition, must_stop
from tuckerl.training.algorithm import register_algorithm
from tuckerl.training.declared_state import Declaration, DeclaredArray, DeclaredRecord
from tuckerl.training.greedy_actions import greedy_value
from tuckerl.training.learner import Learner
from tuckerl.training.parameters import LearnerParameters
from tuckerl.types import BoolArray, IntArray


class PrioritizedSweepingState(NamedTuple):
    """What prioritized sweeping keeps for one agent: a model, its states' predecessors, a queue, and how to plan."""

    outcome: NDArray[np.void]  # (S, A) of OUTCOME
    known: BoolArray  # (S, A) whether a pair has an outcome
    first: IntArray  # (S,) of `Predecessors`, as the next two are
    following: IntArray  # (S, A)
    preceding: IntArray  # (S, A)
    queue: PriorityQueue
    n_steps: int  # planned updates after each real step, at most
    theta: float  # the queue takes pairs whose priority is above it


@kernel
def remember(model: PrioritizedSweepingState, agent: AgentArrays, transition: Transition) -> None:
    """Put a transition into the model in place of the pair's last one, and the pair into the next state's list.

    A pair whose outcome ended the return does not depend on any state's value, and is nobody's predecessor.

    Parameters
    ----------
    model : PrioritizedSweepingState
        Its `outcome` and `known`, (S, A), change at the transition's state and action; its lists change.
    agent : AgentArrays
    transition : Transition
    """
    state, action, next_state = transition.state, transition.action, transition.next_state
    lists = Predecessors(model.first, model.following, model.preceding)
    before = model.outcome[state, action]
    left = int(before["next_state"]) if before["discount"] > 0.0 else -1
    entered = int(next_state) if transition.discount > 0.0 else -1
    keep_row(agent.log, state)
    if left != entered:
        move(lists, agent.log, state, action, left, entered)
    keep_outcome(model.outcome, transition)
    model.known[state, action] = True


@kernel
def plan(model: PrioritizedSweepingState, agent: AgentArrays) -> float:
    """Update the pairs of the highest priorities, which changes ``agent.q`` (S, A), and queue their predecessors.

    Returns
    -------
    float
        The sum of the new values: not finite if one of them is not.
    """
    total, queue, n_actions = 0.0, model.queue, agent.q.shape[1]
    for number in range(model.n_steps):
        if queue.size[0] == 0 or must_stop(agent.record, number):
            break
        pair = take_first(queue)
        state, action = pair // n_actions, pair % n_actions
        outcome = model.outcome[state, action]
        reward, discount, next_state = outcome["reward"], outcome["discount"], outcome["next_state"]
        record_change(agent.log, state)
        total += move_towards_target(agent, state, action, reward, discount, next_state)
        value, before = greedy_value(agent, state), model.first[state]
        while before > 0:
            earlier, leading = (before - 1) // n_actions, (before - 1) % n_actions
            outcome = model.outcome[earlier, leading]
            priority = abs(outcome["reward"] + outcome["discount"] * value - agent.q[earlier, leading])
            if priority > model.theta:
                insert(queue, before - 1, priority)
            before = model.following[earlier, leading]
    return total


@kernel
def update(algorithm: PrioritizedSweepingState, agent: AgentArrays, transition: Transition, next_action: int) -> bool:
    """Remember a step, queue its pair and plan: ``agent.q`` (S, A) and the model change."""
    state, action, reward, discount, next_state, _ = transition
    remember(algorithm, agent, transition)
    priority = abs(reward + discount * greedy_value(agent, next_state) - agent.q[state, action])
    if priority > algorithm.theta:
        insert(algorithm.queue, state * agent.q.shape[1] + action, priority)
    return np.isfinite(plan(algorithm, agent))


register_algorithm(PrioritizedSweepingState, update=update, keeps_maxima=True)


class PrioritizedSweeping(Learner):
    """Prioritized sweeping for one agent or several, each with its own model and its own copy of the problem.

    All learning is in the planned updates: a real step only puts its pair into the queue.

    Parameters
    ----------
    env
        As for every :class:`~tuckerl.training.learner.Learner`, whose other parameters hold too.
    planning_steps : int
        Updates after each real step, at most: fewer where the queue becomes empty.
    theta : float
        Pairs whose update would change their value by no more are left out.

    References
    ----------
    Moore and Atkeson, *Prioritized sweeping*, Machine Learning 13, 1993; Peng and Williams, *Efficient learning and
    planning within the Dyna framework*, Adaptive Behavior 1, 1993; Sutton and Barto, *Reinforcement Learning*, 2018,
    section 8.4.

    Examples
    --------
    >>> import tuckerl
    >>> agent = tuckerl.PrioritizedSweeping(tuckerl.sutton_maze(), alpha=0.5, seed=0).learn(episodes=50)
    >>> int(agent.steps.min())
    14
    """

    state_type = PrioritizedSweepingState

    def __init__(
        self,
        env: Environment,
        *,
        planning_steps: int = 10,
        theta: float = 1e-4,
        **parameters: Unpack[LearnerParameters],
    ) -> None:
        self.planning_steps = check_int("planning_steps", planning_steps, 1, np.iinfo(np.int64).max)
        self.theta = check_real("theta", theta, 0.0)
        super().__init__(env, **parameters)

    def declare_state(self) -> tuple[Declaration, ...]:
        """Return the model, the predecessors and the queue, which each agent keeps to itself."""
        pairs = (0, self.problem.n_states * self.problem.n_actions)
        return (
            DeclaredArray("model.outcome", "none", dtype=OUTCOME),
            DeclaredArray("model.known", "none", dtype=np.bool_),
            DeclaredArray("predecessors.first", "none", ("states",), np.int64, bounds=pairs),
            DeclaredArray("predecessors.following", "none", dtype=np.int64, bounds=pairs),
            DeclaredArray("predecessors.preceding", "none", dtype=np.int64, bounds=pairs),
            DeclaredRecord("queue", "none", empty_queue),
        )

    def check_declared(self, declared: Mapping[str, Any]) -> None:
        """Refuse a model or a queue of a file whose parts contradict each other: planning uses them as indices."""
        outcome, known = declared["model.outcome"], declared["model.known"]
        check_outcomes(outcome[known], self.problem.n_states)
        if outcome["discount"][~known].any():
            raise SavedFileError("a model must hold nothing of pairs that it does not know")
        check_lists(_lists(declared), outcome["next_state"], outcome["discount"] > 0.0)
        if not known.ravel()[declared["queue"].to_arrays()["pair"]].all():
            raise SavedFileError("a queue must hold pairs that the model knows")

    def revise_state(self, before: Settings, now: Settings) -> None:
        """Give what the models hold the discounts of now, and let pairs be predecessors that now depend on a value.

        Raises
        ------
        ImmutableError
            If ends must be told from other steps, which a model with one discount for both cannot do.
        """
        known = [held["model.known"] for held in self.declared]
        outcomes = [held["model.outcome"] for held in self.declared]
        revised = [revised_discounts(o["discount"][k], before, now) for o, k in zip(outcomes, known, strict=True)]
        if (before.gamma, before.terminal_discount) == (now.gamma, now.terminal_discount):
            return
        for held, outcome, where, discounts in zip(self.declared, outcomes, known, revised, strict=True):
            outcome["discount"][where] = discounts
            link_all(_lists(held), outcome["next_state"], outcome["discount"] > 0.0)

    def constants(self) -> dict[str, Any]:
        """Return how to plan."""
        return {"n_steps": self.planning_steps, "theta": self.theta}


def _lists(declared: Mapping[str, Any]) -> Predecessors:
    return Predecessors(*(declared[f"predecessors.{name}"] for name in Predecessors._fields))
