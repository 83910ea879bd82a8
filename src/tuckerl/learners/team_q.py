r"""Team-Q, Watkins' Q(lambda) on the joint states and joint actions of a team; with a tensor step, the paper's Team-TQ.

One table serves the whole team. Each member explores on its own with probability epsilon and else plays its part of the
greedy joint action, so that joint actions are partly random. A joint action that is not greedy cuts the traces: what
came before it did not follow from the policy that is learned. (Littman 2001; Watkins 1989; the paper's section IV.C.)
"""

from typing import Any, Literal, NamedTuple, Unpack

import numpy as np

from tuckerl._jit import kernel
from tuckerl.checks import check_flag, check_name
from tuckerl.generalization.change_log import ChangeLog, close_episode
from tuckerl.learners.episodes import Record, Settings, greedy, note_episode, note_state, row_max
from tuckerl.learners.parameters import LearnerParameters
from tuckerl.learners.traces import Traces, bring_up_to_date, learn, settle
from tuckerl.learners.tracing import TracingLearner
from tuckerl.problems.dynamics import World, reset, step
from tuckerl.problems.mdp import TabularMDP
from tuckerl.problems.resolve import Environment
from tuckerl.rng import below, uniform
from tuckerl.types import FloatArray, IntArray, Stream

_TIE = 1e-12  # values this close differ by the order of additions only, which must not decide


class Team(NamedTuple):
    """What kernels read of a team."""

    sizes: IntArray  # (M,) how many actions each member has; one member where a single draw is for all
    parts: IntArray  # (M,) room for the members' parts of a joint action
    cut: bool  # the traces, by a joint action that is not greedy


@kernel
def team_action(team: Team, q: FloatArray, state: int, epsilon: float, random_ties: bool, rng: Stream) -> int:
    """Return the joint action of a team whose members explore independently."""
    sizes, parts, n_exploring = team.sizes, team.parts, 0
    for member in range(sizes.size):
        parts[member] = -1
        if uniform(rng) < epsilon:
            parts[member] = below(sizes[member], rng)
            n_exploring += 1
    joint = greedy(q, state, random_ties, rng) if n_exploring < sizes.size else 0
    action, place = 0, 1
    for member in range(sizes.size - 1, -1, -1):  # C order: the last member's part counts ones
        part = parts[member] if parts[member] >= 0 else joint % sizes[member]
        joint //= sizes[member]
        action += part * place
        place *= sizes[member]
    return action


@kernel
def _is_worse(q: FloatArray, state: int, action: int) -> bool:
    """Return whether an action's value lies below the row's maximum."""
    best = row_max(q, state)
    return q[state, action] < best - _TIE * abs(best)


@kernel
def play(
    world: World,
    team: Team,
    traces: Traces,
    q: FloatArray,
    rates: FloatArray,
    settings: Settings,
    log: ChangeLog,
    record: Record,
    rng: Stream,
) -> int:
    """Play and learn one team's next episodes; return how many stayed finite."""
    for episode in range(record.steps.size):
        state, steps, total, terminated = reset(world, rng), 0, 0.0, False
        note_state(record, 0, state)
        while not terminated and steps < world.max_episode_steps:
            bring_up_to_date(traces, q, rates, log, state)
            action = team_action(team, q, state, record.epsilon[0], settings.random_ties, rng)
            if team.cut and _is_worse(q, state, action) and not settle(traces, q, rates, log, False):
                return episode
            next_state, reward, terminated = step(world, state, action, rng)
            discount = settings.terminal_discount if terminated else settings.gamma
            bring_up_to_date(traces, q, rates, log, next_state)
            delta = reward + discount * row_max(q, next_state) - q[state, action]
            if not learn(traces, q, rates, log, state, action, delta):
                return episode
            state, steps, total = next_state, steps + 1, total + reward
            note_state(record, steps, state)
        if not settle(traces, q, rates, log, traces.decay.carried):
            return episode
        note_episode(record, settings, episode, steps, total)
        close_episode(log, q)
    return record.steps.size


class TeamQ(TracingLearner):
    """Team-Q for one team or several, each in its own copy of the problem; `n_agents` counts teams.

    Parameters
    ----------
    env
        A joint problem: a :class:`~tuckerl.TabularMDP` with `action_sizes`, or a PettingZoo parallel environment that
        carries one. :class:`~tuckerl.learners.tracing.TracingLearner` has the other parameters.
    cut : bool
        Whether a joint action below the row's maximum zeroes all traces before its own update (Watkins).
    exploration : "members" or "team"
        Whether each member draws on its own, or one draw makes the whole joint action random.

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

    _teams = True

    def __init__(
        self,
        env: Environment,
        *,
        cut: bool = True,
        exploration: Literal["members", "team"] = "members",
        lambda_: float = 0.95,
        trace: Literal["replacing", "accumulating"] = "replacing",
        carry_trace: bool = False,
        **parameters: Unpack[LearnerParameters],
    ) -> None:
        super().__init__(env, lambda_=lambda_, trace=trace, carry_trace=carry_trace, **parameters)
        self.cut = check_flag("cut", cut)
        self.exploration = check_name("exploration", exploration, ("members", "team"))
        sizes: tuple[int, ...] = (self.problem.n_actions,)
        if isinstance(self.problem, TabularMDP) and self.exploration == "members":
            sizes = self.problem.action_sizes
        self._team = Team(np.array(sizes, dtype=np.int64), np.zeros(len(sizes), dtype=np.int64), self.cut)

    def _play(self, agent: int, record: Record) -> int:
        return play(
            self._worlds[agent],
            self._team,
            self._traces[agent],
            self._q[agent],
            self.alpha * self._weights,
            self._settings,
            self._logs[agent],
            record,
            self._streams[agent],
        )

    def _parameters(self) -> dict[str, Any]:
        return super()._parameters() | {"cut": self.cut, "exploration": self.exploration}
