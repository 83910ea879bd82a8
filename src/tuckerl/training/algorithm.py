"""An algorithm as kernels: how to act, what to learn from a step, what ends an episode.

The kernels of an algorithm are registered under the type of its state, a NamedTuple. Which ones a loop calls is decided
when the loop is compiled, from that type, so that one loop serves all algorithms at no cost.
"""

from collections.abc import Callable
from typing import Any

from tuckerl._jit import ByKind, kernel
from tuckerl.errors import LearnerError
from tuckerl.training.agent_arrays import AgentArrays, Transition
from tuckerl.training.guards import STOPS, guarded_act, guarded_end, guarded_update
from tuckerl.training.policies.policy import choose

NOT_FINITE = STOPS
"""What `act` and `learn_and_act` return instead of an action when a value is not finite any more."""

_ACT: dict[type, Callable[..., int]] = {}
_UPDATE: dict[type, Callable[..., bool]] = {}
_END_EPISODE: dict[type, Callable[..., bool]] = {}
_LEARN_AND_ACT: dict[type, Callable[..., int]] = {}
KEEP_MAXIMA: set[type] = set()
"""The types of states of algorithms whose kernels change their table by `change_value` alone."""

act = ByKind(_ACT)
"""``act(agent.algorithm, agent, state)`` chooses an action in a state."""

end_episode = ByKind(_END_EPISODE)
"""``end_episode(agent.algorithm, agent, finished)`` returns whether the tables are finite."""

learn_and_act = ByKind(_LEARN_AND_ACT)
"""``learn_and_act(agent.algorithm, agent, transition)`` learns from a step and returns the next action."""

_update = ByKind(_UPDATE)


@kernel
def act_by_policy(algorithm: Any, agent: AgentArrays, state: int) -> int:
    """Let the agent's policy choose, with nothing to be done before."""
    return choose(agent.policy, agent, state)


@kernel
def _nothing_to_end(algorithm: Any, agent: AgentArrays, finished: bool) -> bool:
    return True


def register_algorithm(
    state_type: type,
    *,
    update: Callable[..., bool],
    act: Callable[..., int] = act_by_policy,
    end_episode: Callable[..., bool] = _nothing_to_end,
    on_policy: bool = False,
    keeps_maxima: bool = False,
) -> None:
    """Register the kernels of an algorithm under the type of its state.

    Parameters
    ----------
    state_type : type
        A NamedTuple: what the algorithm keeps for one agent besides its Q-table.
    update : kernel ``(algorithm, agent, transition, next_action) -> bool``
        Learns from a step; returns whether the values that it wrote are finite. `next_action` has a meaning only with
        `on_policy`.
    act : kernel ``(algorithm, agent, state) -> action``, optional
        Chooses an action that ``agent.action_mask`` allows, or returns `NOT_FINITE`. Default: the policy does.
    end_episode : kernel ``(algorithm, agent, finished) -> bool``, optional
        Called at the end of an episode, with `finished` False where a value is not finite any more; returns whether
        the tables are finite. Default: nothing to do. An episode that an error breaks off is undone instead.
    on_policy : bool
        Whether the next action is chosen before the update, which learns from it (also after a truncation, whose value
        is bootstrapped), as in SARSA. Otherwise it is chosen after the update, as in Q-learning.
    keeps_maxima : bool
        Whether its kernels change ``agent.q`` by `change_value` alone. Of many actions, greedy ones are then known
        without looking at all of them; a promise that is not kept makes them wrong.

    Raises
    ------
    ParameterError, ParameterTypeError
        If a kernel takes other arguments, or is no function.
    """
    guarded = guarded_act(act), guarded_update(update), guarded_end(end_episode)
    _ACT[state_type], _UPDATE[state_type], _END_EPISODE[state_type] = guarded
    _LEARN_AND_ACT[state_type] = _act_then_update if on_policy else _update_then_act
    if keeps_maxima:
        KEEP_MAXIMA.add(state_type)


@kernel
def _act_then_update(algorithm: Any, agent: AgentArrays, transition: Transition) -> int:
    next_action = act(algorithm, agent, transition.next_state)
    if next_action == NOT_FINITE:
        return NOT_FINITE
    return next_action if _update(algorithm, agent, transition, next_action) else NOT_FINITE


@kernel
def _update_then_act(algorithm: Any, agent: AgentArrays, transition: Transition) -> int:
    if not _update(algorithm, agent, transition, 0):
        return NOT_FINITE
    return 0 if transition.ended else act(algorithm, agent, transition.next_state)


def check_registered(learner: type) -> None:
    """Refuse a class of learners whose kernels nobody has registered.

    Raises
    ------
    LearnerError
        If that is so.
    """
    state_type = getattr(learner, "state_type", None)
    if state_type is None:
        raise LearnerError(
            f"{learner.__name__} has no algorithm: set its state_type to the NamedTuple that its kernels "
            "are registered under by register_algorithm"
        )
    if state_type not in _UPDATE:
        raise LearnerError(
            f"no kernels are registered for {state_type.__name__}, the state_type of {learner.__name__}: call "
            f"register_algorithm({state_type.__name__}, update=...) in its file"
        )
