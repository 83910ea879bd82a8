r"""Team-Q, Watkins' Q(lambda) on the joint states and joint actions of a team; with a tensor step, the paper's Team-TQ.

One table serves the whole team. Each agent explores on its own with probability epsilon and else plays its part of
the greedy joint action, so that joint actions are partly random. A joint action that is not greedy cuts the traces:
what came before it did not follow from the policy that is learned. (Littman 2001; Watkins 1989; the paper's section
IV.C.)
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Literal, NamedTuple, Unpack

import numpy as np

from tuckerl._jit import kernel
from tuckerl.adapters.resolve import AdapterOptions, Agents, Environment
from tuckerl.checks import check_flag, check_name
from tuckerl.errors import ProblemError
from tuckerl.learners.team_policy import TeamEpsilonGreedy
from tuckerl.learners.traces import Traces
from tuckerl.learners.tracing import TracingLearner, act_on_synced_row, end_with_traces
from tuckerl.learners.watkins_q_lambda import act_and_cut, update
from tuckerl.training.agent_arrays import AgentArrays
from tuckerl.training.algorithm import register_algorithm
from tuckerl.training.parameters import LearnerParameters
from tuckerl.training.policies.epsilon_greedy import EpsilonGreedy
from tuckerl.training.policies.policy import Policy
from tuckerl.types import BoolArray


class TeamQState(NamedTuple):
    """Team-Q keeps traces."""

    traces: Traces
    cut_traces: bool  # by a joint action that is not greedy


@kernel
def act(algorithm: TeamQState, agent: AgentArrays, state: int) -> int:
    """Choose a joint action; one below the maximum of its row in ``agent.q`` (S, A) cuts the traces, or not."""
    if algorithm.cut_traces:
        return act_and_cut(algorithm, agent, state)
    return act_on_synced_row(algorithm, agent, state)


register_algorithm(TeamQState, act=act, update=update, end_episode=end_with_traces)


class TeamQ(TracingLearner):
    """Team-Q for one team or several, each in its own copy of the problem; `n_agents` counts teams.

    Parameters
    ----------
    env
        A joint problem: a :class:`~tuckerl.TabularMDP` with `action_sizes`, or a PettingZoo parallel environment with
        finite spaces, by id, instance or callable. :class:`~tuckerl.learners.tracing.TracingLearner` has the other
        parameters.
    cut_traces : bool
        Whether a joint action below the row's maximum zeroes all traces before its own update (Watkins).
    exploration : "independent" or "joint"
        Whether each agent draws on its own, or one draw makes the whole joint action random.
    team_reward : str
        What the team is paid: the ``"mean"`` or the ``"sum"`` of its agents' rewards, or one agent's, by its name.
        Joint transitions that an environment carries pay the mean; for anything else it is stepped.

    Raises
    ------
    ParameterError
        If `team_reward` is given for a problem that is no PettingZoo environment.
    ProblemError
        If a problem's action masks are not independent of each other and agents explore on their own.

    References
    ----------
    Littman, Cognitive Systems Research 2, 2001; Watkins, *Learning from Delayed Rewards*, 1989; the paper's Figure 13.

    Examples
    --------
    >>> import tuckerl
    >>> team = tuckerl.TeamQ("tuckerl/RobotRescue-v0", seed=0).learn(episodes=2)
    >>> team.q.shape
    (1, 36864, 25)
    """

    state_type = TeamQState
    reads_agents = Agents.JOINT

    def __init__(
        self,
        env: Environment,
        *,
        cut_traces: bool = True,
        exploration: Literal["independent", "joint"] = "independent",
        team_reward: str = "mean",
        lambda_: float = 0.95,
        trace: Literal["replacing", "accumulating"] = "replacing",
        carry_trace: bool = False,
        **parameters: Unpack[LearnerParameters],
    ) -> None:
        self.team_reward = team_reward
        self.cut_traces = check_flag("cut_traces", cut_traces)
        self.exploration = check_name("exploration", exploration, ("independent", "joint"))
        super().__init__(env, lambda_=lambda_, trace=trace, carry_trace=carry_trace, **parameters)

    def adapt_policy(self, policy: Policy) -> Policy:
        """Return a policy by which every agent explores on its own, if the given one is epsilon-greedy."""
        sizes = self.problem.action_sizes
        if self.exploration == "joint" or len(sizes) == 1 or type(policy) is not EpsilonGreedy:
            return policy
        if self.problem.action_mask is not None:
            _check_independent(self.problem.action_mask, sizes)
        return TeamEpsilonGreedy(policy, sizes)

    def constants(self) -> dict[str, Any]:
        """Return whether traces are cut."""
        return {"cut_traces": self.cut_traces}

    @classmethod
    def adapter_options(cls, parameters: Mapping[str, Any]) -> AdapterOptions:
        """Return how a team with these parameters reads its environment."""
        return replace(super().adapter_options(parameters), reward=parameters.get("team_reward", "mean"))


def _check_independent(action_mask: BoolArray, sizes: tuple[int, ...]) -> None:
    """Refuse masks by which agents that explore on their own could meet in a forbidden joint action."""
    allowed = action_mask.reshape(-1, *sizes)
    independent = np.ones_like(allowed)
    for i in range(1, allowed.ndim):
        others = tuple(axis for axis in range(1, allowed.ndim) if axis != i)
        independent &= allowed.any(axis=others, keepdims=True)
    if (independent != allowed).any():
        state = int(np.argwhere(independent != allowed)[0, 0])
        raise ProblemError(
            f"the agents' action masks must be independent of each other where agents explore on their own; in state "
            f"{state} a joint action is forbidden whose parts are allowed beside others: use exploration='joint'"
        )
