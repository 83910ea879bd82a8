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
from tuckerl.learners.traces import Traces, flush_traces, learn, sync_row
from tuckerl.learners.tracing import TracingLearner
from tuckerl.rng import below, uniform
from tuckerl.training.agent_arrays import Agent, Transition
from tuckerl.training.loop import NOT_FINITE, algorithm
from tuckerl.training.parameters import LearnerParameters
from tuckerl.training.policies import best_value, greedy
from tuckerl.types import BoolArray, IntArray

_TIE = 1e-12  # values this close differ by the order of additions only, which must not decide


class Team(NamedTuple):
    """What kernels read of a team."""

    sizes: IntArray  # (M,) how many actions each agent_place has; one agent_place where a single draw is for all
    parts: IntArray  # (M,) room for the agents' parts of a joint action
    cut_traces: bool  # by a joint action that is not greedy


class TeamMethod(NamedTuple):
    """Team-Q keeps traces and knows its agents."""

    traces: Traces
    team: Team


@kernel
def team_action(team: Team, agent: Agent, state: int, epsilon: float) -> int:
    """Return the joint action of a team whose agents explore independently."""
    sizes, parts, n_exploring, place = team.sizes, team.parts, 0, agent.q.shape[1]
    for agent_place in range(sizes.size):
        parts[agent_place] = -1
        place //= sizes[agent_place]
        if uniform(agent.rng) < epsilon:
            parts[agent_place] = _random_part(agent, state, sizes[agent_place], place)
            n_exploring += 1
    joint = greedy(agent, state) if n_exploring < sizes.size else 0
    action, place = 0, 1
    for agent_place in range(sizes.size - 1, -1, -1):  # C order: the last agent_place's part counts ones
        part = parts[agent_place] if parts[agent_place] >= 0 else joint % sizes[agent_place]
        joint //= sizes[agent_place]
        action += part * place
        place *= sizes[agent_place]
    return action


@kernel
def _random_part(agent: Agent, state: int, size: int, place: int) -> int:
    """Draw what a agent may do; its part counts `place` in a joint action.

    Members' masks are independent of each other: a part may be taken where any joint action with it may.
    """
    if agent.action_mask.size == 0:
        return below(size, agent.rng)
    n_allowed = 0
    for part in range(size):
        n_allowed += _part_is_allowed(agent, state, part, size, place)
    skip = below(n_allowed, agent.rng)
    part = 0
    while skip > 0 or not _part_is_allowed(agent, state, part, size, place):
        skip -= _part_is_allowed(agent, state, part, size, place)
        part += 1
    return part


@kernel
def _part_is_allowed(agent: Agent, state: int, part: int, size: int, place: int) -> bool:
    for action in range(agent.q.shape[1]):
        if action // place % size == part and agent.action_mask[state, action]:
            return True
    return False


@kernel
def choose(method: TeamMethod, agent: Agent, state: int, epsilon: float) -> int:
    """Choose a joint action; one whose value lies below the row's maximum cuts the traces, if it is to."""
    traces, q = method.traces, agent.q
    sync_row(traces, q, agent.step_sizes, agent.log, state)
    action = team_action(method.team, agent, state, epsilon)
    best = best_value(q, agent.action_mask, state)
    is_worse = q[state, action] < best - _TIE * abs(best)
    if method.team.cut_traces and is_worse and not flush_traces(traces, q, agent.step_sizes, agent.log, False):
        return NOT_FINITE
    return action


@kernel
def turn(method: TeamMethod, agent: Agent, seen: Transition, epsilon: float) -> int:
    """Let the error reach all pairs that have a trace, and choose the next joint action."""
    traces, q, state, action = method.traces, agent.q, seen.state, seen.action
    sync_row(traces, q, agent.step_sizes, agent.log, seen.next_state)
    delta = seen.reward + seen.discount * best_value(q, agent.action_mask, seen.next_state) - q[state, action]
    if not learn(traces, q, agent.step_sizes, agent.log, state, action, delta):
        return NOT_FINITE
    return 0 if seen.ended else choose(method, agent, seen.next_state, epsilon)


@kernel
def leave(method: TeamMethod, agent: Agent, finished: bool) -> bool:
    """Bring all rows up to date; traces go on into the next episode only if they are to, and this one was finished."""
    keep = finished and method.traces.decay.carried
    return flush_traces(method.traces, agent.q, agent.step_sizes, agent.log, keep)


algorithm(TeamMethod, first=choose, turn=turn, leave=leave)


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

    _agents = Agents.JOINT

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
        super().__init__(env, lambda_=lambda_, trace=trace, carry_trace=carry_trace, **parameters)
        self.cut_traces = check_flag("cut_traces", cut_traces)
        self.exploration = check_name("exploration", exploration, ("independent", "joint"))
        sizes: tuple[int, ...] = (self.problem.n_actions,)
        if self.exploration == "independent":
            sizes = self.problem.action_sizes
        if self.problem.action_mask is not None:
            _check_independent(self.problem.action_mask, sizes)
        self._team = Team(np.array(sizes, dtype=np.int64), np.zeros(len(sizes), dtype=np.int64), self.cut_traces)

    def _method(self, table: int) -> TeamMethod:
        return TeamMethod(self._traces[table], self._team)

    def _parameters(self) -> dict[str, Any]:
        return super()._parameters() | {
            "cut_traces": self.cut_traces,
            "exploration": self.exploration,
            "team_reward": self.team_reward,
        }

    @classmethod
    def reading_of(cls, parameters: Mapping[str, Any]) -> AdapterOptions:
        """Return how a team with these parameters reads its environment."""
        return replace(super().reading_of(parameters), reward=parameters.get("team_reward", "mean"))


def _check_independent(action_mask: BoolArray, sizes: tuple[int, ...]) -> None:
    """Refuse masks by which agents that explore on their own could meet in a forbidden joint action."""
    allowed = action_mask.reshape(-1, *sizes)
    independent = np.ones_like(allowed)
    for agent_place in range(1, allowed.ndim):
        others = tuple(axis for axis in range(1, allowed.ndim) if axis != agent_place)
        independent &= allowed.any(axis=others, keepdims=True)
    if (independent != allowed).any():
        state = int(np.argwhere(independent != allowed)[0, 0])
        raise ProblemError(
            f"the agents' action masks must be independent of each other where agents explore on their own; in state "
            f"{state} a joint action is forbidden whose parts are allowed beside others: use exploration='joint'"
        )
