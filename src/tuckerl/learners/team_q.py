r"""Team-Q, Watkins' Q(lambda) on the joint states and joint actions of a team; with a tensor step, the paper's Team-TQ.

One table serves the whole team. Each member explores on its own with probability epsilon and else plays its part of the
greedy joint action, so that joint actions are partly random. A joint action that is not greedy cuts the traces: what
came before it did not follow from the policy that is learned. (Littman 2001; Watkins 1989; the paper's section IV.C.)
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Literal, NamedTuple, Unpack

import numpy as np

from tuckerl._jit import kernel
from tuckerl.checks import check_flag, check_name
from tuckerl.errors import ProblemError
from tuckerl.learners.choices import best_value, greedy
from tuckerl.learners.episodes import Agent, Transition
from tuckerl.learners.parameters import LearnerParameters
from tuckerl.learners.play import NOT_FINITE, algorithm
from tuckerl.learners.traces import Traces, bring_up_to_date, learn, settle
from tuckerl.learners.tracing import TracingLearner
from tuckerl.problems.mdp import TabularMDP
from tuckerl.problems.resolve import Agents, Environment, Reading
from tuckerl.problems.stepped import SteppedProblem
from tuckerl.rng import below, uniform
from tuckerl.types import BoolArray, IntArray

_TIE = 1e-12  # values this close differ by the order of additions only, which must not decide


class Team(NamedTuple):
    """What kernels read of a team."""

    sizes: IntArray  # (M,) how many actions each member has; one member where a single draw is for all
    parts: IntArray  # (M,) room for the members' parts of a joint action
    cut: bool  # the traces, by a joint action that is not greedy


class TeamMethod(NamedTuple):
    """Team-Q keeps traces and knows its members."""

    traces: Traces
    team: Team


@kernel
def team_action(team: Team, agent: Agent, state: int, epsilon: float) -> int:
    """Return the joint action of a team whose members explore independently."""
    sizes, parts, n_exploring, place = team.sizes, team.parts, 0, agent.q.shape[1]
    for member in range(sizes.size):
        parts[member] = -1
        place //= sizes[member]
        if uniform(agent.rng) < epsilon:
            parts[member] = _random_part(agent, state, sizes[member], place)
            n_exploring += 1
    joint = greedy(agent, state) if n_exploring < sizes.size else 0
    action, place = 0, 1
    for member in range(sizes.size - 1, -1, -1):  # C order: the last member's part counts ones
        part = parts[member] if parts[member] >= 0 else joint % sizes[member]
        joint //= sizes[member]
        action += part * place
        place *= sizes[member]
    return action


@kernel
def _random_part(agent: Agent, state: int, size: int, place: int) -> int:
    """Draw what a member may do; its part counts `place` in a joint action.

    Members' masks are independent of each other: a part may be taken where any joint action with it may.
    """
    if agent.forbidden.size == 0:
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
        if action // place % size == part and not agent.forbidden[state, action]:
            return True
    return False


@kernel
def choose(method: TeamMethod, agent: Agent, state: int, epsilon: float) -> int:
    """Choose a joint action; one whose value lies below the row's maximum cuts the traces, if it is to."""
    traces, q = method.traces, agent.q
    bring_up_to_date(traces, q, agent.rates, agent.log, state)
    action = team_action(method.team, agent, state, epsilon)
    best = best_value(q, agent.forbidden, state)
    is_worse = q[state, action] < best - _TIE * abs(best)
    if method.team.cut and is_worse and not settle(traces, q, agent.rates, agent.log, False):
        return NOT_FINITE
    return action


@kernel
def turn(method: TeamMethod, agent: Agent, seen: Transition, epsilon: float) -> int:
    """Let the error reach all pairs that have a trace, and choose the next joint action."""
    traces, q, state, action = method.traces, agent.q, seen.state, seen.action
    bring_up_to_date(traces, q, agent.rates, agent.log, seen.next_state)
    delta = seen.reward + seen.discount * best_value(q, agent.forbidden, seen.next_state) - q[state, action]
    if not learn(traces, q, agent.rates, agent.log, state, action, delta):
        return NOT_FINITE
    return 0 if seen.ended else choose(method, agent, seen.next_state, epsilon)


@kernel
def leave(method: TeamMethod, agent: Agent, finished: bool) -> bool:
    """Bring all rows up to date; traces go on into the next episode only if they are to, and this one was finished."""
    keep = finished and method.traces.decay.carried
    return settle(method.traces, agent.q, agent.rates, agent.log, keep)


algorithm(TeamMethod, first=choose, turn=turn, leave=leave)


class TeamQ(TracingLearner):
    """Team-Q for one team or several, each in its own copy of the problem; `n_agents` counts teams.

    Parameters
    ----------
    env
        A joint problem: a :class:`~tuckerl.TabularMDP` with `action_sizes`, or a PettingZoo parallel environment with
        finite spaces, by id, instance or callable. :class:`~tuckerl.learners.tracing.TracingLearner` has the other
        parameters.
    cut : bool
        Whether a joint action below the row's maximum zeroes all traces before its own update (Watkins).
    exploration : "members" or "team"
        Whether each member draws on its own, or one draw makes the whole joint action random.
    team_reward : str
        What the team is paid: the ``"mean"`` or the ``"sum"`` of its members' rewards, or one member's, by its name.
        Joint transitions that an environment carries pay the mean; for anything else it is stepped.

    Raises
    ------
    ParameterError
        If `team_reward` is given for a problem that is no PettingZoo environment.
    ProblemError
        If a problem's action masks are not independent of each other and members explore on their own.

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

    _agents = Agents.TEAM

    def __init__(
        self,
        env: Environment,
        *,
        cut: bool = True,
        exploration: Literal["members", "team"] = "members",
        team_reward: str = "mean",
        lambda_: float = 0.95,
        trace: Literal["replacing", "accumulating"] = "replacing",
        carry_trace: bool = False,
        **parameters: Unpack[LearnerParameters],
    ) -> None:
        self.team_reward = team_reward
        super().__init__(env, lambda_=lambda_, trace=trace, carry_trace=carry_trace, **parameters)
        self.cut = check_flag("cut", cut)
        self.exploration = check_name("exploration", exploration, ("members", "team"))
        sizes: tuple[int, ...] = (self.problem.n_actions,)
        if isinstance(self.problem, (TabularMDP, SteppedProblem)) and self.exploration == "members":
            sizes = self.problem.action_sizes
        if isinstance(self.problem, TabularMDP):
            _check_independent(self.problem.arrays.forbidden, sizes)
        self._team = Team(np.array(sizes, dtype=np.int64), np.zeros(len(sizes), dtype=np.int64), self.cut)

    def _method(self, table: int) -> TeamMethod:
        return TeamMethod(self._traces[table], self._team)

    def _parameters(self) -> dict[str, Any]:
        return super()._parameters() | {
            "cut": self.cut,
            "exploration": self.exploration,
            "team_reward": self.team_reward,
        }

    @classmethod
    def reading_of(cls, parameters: Mapping[str, Any]) -> Reading:
        """Return how a team with these parameters reads its environment."""
        return replace(super().reading_of(parameters), reward=parameters.get("team_reward", "mean"))


def _check_independent(forbidden: BoolArray, sizes: tuple[int, ...]) -> None:
    """Refuse masks by which members that explore on their own could meet in a forbidden joint action."""
    if forbidden.size == 0:
        return
    allowed = ~forbidden.reshape(-1, *sizes)
    independent = np.ones_like(allowed)
    for member in range(1, allowed.ndim):
        others = tuple(axis for axis in range(1, allowed.ndim) if axis != member)
        independent &= allowed.any(axis=others, keepdims=True)
    if (independent != allowed).any():
        state = int(np.argwhere(independent != allowed)[0, 0])
        raise ProblemError(
            f"the members' action masks must be independent of each other where members explore on their own; in state "
            f"{state} a joint action is forbidden whose parts are allowed beside others: use exploration='team'"
        )
