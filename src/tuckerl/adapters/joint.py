"""A PettingZoo parallel environment as one Gymnasium environment over joint observations and joint actions.

The inverse is :mod:`tuckerl.adapters.split`.
"""

import copy
from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from numpy.typing import NDArray
from pettingzoo import ParallelEnv

from tuckerl.adapters.making import way_out
from tuckerl.adapters.masks import MASK, MaskReader
from tuckerl.adapters.step_results import as_flag, check_reward, reset_result, step_result
from tuckerl.checks import check_name, shown
from tuckerl.errors import ParameterError, ParameterTypeError, ProblemError
from tuckerl.spaces.description import difference_of_spaces
from tuckerl.types import BoolArray

INFOS = "infos"
"""Where a joint environment's info keeps those of the agents."""

JointStep = tuple[tuple[Any, ...], float, bool, bool, dict[str, Any]]


class JointEnv(gymnasium.Env[tuple[Any, ...], tuple[Any, ...]]):
    """A PettingZoo parallel environment as one Gymnasium environment over joint observations and joint actions.

    Both are tuples with one element for each of ``env.possible_agents``, in that order. An agent that leaves before the
    others keeps its last observation, earns nothing more, and what is chosen for it is not passed on. The episode ends
    when the last agents leave: truncated if any of these was truncated, terminated if none was or all were terminated.

    Parameters
    ----------
    env : pettingzoo.ParallelEnv
        With the list ``possible_agents``; each of these must be observed at the reset.
    reward : str
        "mean" or "sum" over ``possible_agents``, or the one of these agents whose reward counts.

    Attributes
    ----------
    env : pettingzoo.ParallelEnv
    possible_agents : list
    observation_space, action_space : gymnasium.spaces.Tuple
        Of the agents' spaces; where an observation holds an action mask, of the part beside it.
    readers : dict of MaskReader by agent
        Separate the agents' observations from their masks.

    Raises
    ------
    ParameterTypeError
        If `env` is no parallel environment.
    ProblemError
        If it lacks ``possible_agents``; later, if its agents are not among these, one is alive and not observed, or an
        agent's spaces are others than they were.
    UnknownNameError
        If `reward` is neither a rule nor an agent.

    Notes
    -----
    ``info`` holds ``"infos"``, a dict of the agents' own infos, and, if any agent has an action mask,
    ``"action_mask"``, a tuple of (A_agent,) int8 arrays as ``action_space.sample(mask=...)`` takes it, None for an
    agent that gave none. An agent that has left may only take its first action, so that the values of its other actions
    do not change. When the last agents are truncated their masks stay, because learners may still bootstrap from there.

    ``reset`` passes seed and options on. ``np_random`` is seeded as Gymnasium asks; nothing is drawn from it.

    Examples
    --------
    >>> import pettingzoo, tuckerl
    >>> env = tuckerl.JointEnv(pettingzoo.make("parallel", "tuckerl/RobotRescue-v0"))
    >>> env.action_space
    Tuple(Discrete(5), Discrete(5))
    >>> observation, info = env.reset(seed=0)
    >>> observation, reward, terminated, truncated, info = env.step((2, 4))  # robot_0 up, robot_1 stays
    """

    def __init__(self, env: ParallelEnv, reward: str = "mean") -> None:
        if not isinstance(env, ParallelEnv):
            raise ParameterTypeError(f"env must be a PettingZoo parallel environment; got {shown(env)}{way_out(env)}")
        self.env = env
        self.possible_agents = agents_of(env)
        if not any(isinstance(reward, type(agent)) and reward == agent for agent in self.possible_agents):
            check_name("reward", reward, {"mean", "sum", *(a for a in self.possible_agents if isinstance(a, str))})
        self.reward = reward
        self._declared = {agent: self._spaces_of(agent) for agent in self.possible_agents}
        self.readers = {agent: MaskReader(*own) for agent, own in self._declared.items()}
        self.observation_space = spaces.Tuple(reader.observation_space for reader in self.readers.values())
        self.action_space = spaces.Tuple(reader.action_space for reader in self.readers.values())
        self.metadata = {"render_modes": [], **getattr(env, "metadata", {})}
        self.render_mode = getattr(env, "render_mode", None)
        self._live: tuple[Any, ...] = ()
        self._left: set[Any] = set()
        self._seen: dict[Any, Any] = {}
        self._masks: dict[Any, BoolArray | None] = {}
        self._widths: dict[Any, int] = {}  # of the masks that came in this episode

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[tuple[Any, ...], dict[str, Any]]:
        """Begin an episode of all agents.

        Raises
        ------
        ProblemError
            If no agent is there, an unknown one is, one of ``possible_agents`` is not observed, or its spaces are
            others than they were.
        """
        super().reset(seed=seed)
        self._live, self._left, self._seen, self._masks, self._widths = (), set(), {}, {}, {}
        observations, infos = reset_result(self.env.reset(seed=seed, options=options))
        self._check_spaces()
        live = self._live_agents()
        if not live:
            raise ProblemError(f"{self.env} must have agents after its reset; its list `agents` is empty")
        self._see(self.possible_agents, observations, infos)
        missing = [agent for agent in self.possible_agents if agent not in self._seen]
        if missing:
            raise ProblemError(
                f"the reset of {self.env} must return an observation of every agent in possible_agents, as joint "
                f"observations hold one of each; it returned none of {', '.join(map(str, missing))}"
            )
        self._live = live
        return self._observation(), self._info(infos, live)

    def step(self, action: Sequence[Any]) -> JointStep:
        """Let all agents that are still there act at once.

        Parameters
        ----------
        action : sequence
            One action for each of ``possible_agents``.

        Raises
        ------
        ResetNeeded
            If no episode is under way.
        ParameterError
            If it is not one action for each agent.
        ProblemError
            If the environment breaks PettingZoo's rules: an agent is unknown, not observed or without a reward. One
            that is still reported after its end is not looked at.
        """
        acted = self._live
        if not acted:
            raise ResetNeeded("call reset() before step(): no episode is under way")
        observations, rewards, *ends, infos = step_result(self.env.step(self._actions(action)))
        terminations, truncations = ({agent: as_flag("an end", end) for agent, end in one.items()} for one in ends)
        self._left |= {agent for agent in acted if terminations.get(agent) or truncations.get(agent)}
        self._live = live = self._live_agents()
        self._see((*acted, *(agent for agent in live if agent not in acted)), observations, infos)
        reward = self._reward(acted, rewards)
        if live:
            return self._observation(), reward, False, False, self._info(infos, live)
        cut = [agent for agent in acted if truncations.get(agent)]
        terminated = not cut or all(terminations.get(agent) for agent in acted)
        choosers = [agent for agent in cut if not terminations.get(agent)]
        return self._observation(), reward, terminated, bool(cut), self._info(infos, choosers)

    def render(self) -> Any:
        """Return what the parallel environment's own ``render`` returns."""
        return self.env.render()

    def close(self) -> None:
        """Close the parallel environment."""
        self.env.close()

    def __str__(self) -> str:
        return f"<JointEnv<{self.env}>>"

    def _spaces_of(self, agent: Any) -> tuple[spaces.Space[Any], spaces.Space[Any]]:
        return self.env.observation_space(agent), self.env.action_space(agent)

    def _check_spaces(self) -> None:
        """Refuse spaces that are others than those that the joint ones were made of."""
        for agent, before in self._declared.items():
            for what, was, now in zip(("observation", "action"), before, self._spaces_of(agent), strict=True):
                if difference := difference_of_spaces(was, now, f"{what} of {agent}"):
                    raise ProblemError(
                        f"the spaces of {self.env} must stay as they are, as joint ones are made of them: {difference};"
                        " declare the largest, and mask actions"
                    )

    def _live_agents(self) -> tuple[Any, ...]:
        # Environments change their list in place, and some go on to report who has left.
        live = tuple(agent for agent in self.env.agents if agent not in self._left)
        for agent in live:
            if agent not in self.readers:
                known = ", ".join(map(str, self.possible_agents))
                raise ProblemError(
                    f"the agents of {self.env} must be among its possible_agents, {known}; got {shown(agent)}"
                )
        return live

    def _actions(self, action: Sequence[Any]) -> dict[Any, Any]:
        try:
            pairs = dict(zip(self.possible_agents, action, strict=True))
        except (TypeError, ValueError) as error:
            raise ParameterError(
                f"a joint action must hold {len(self.possible_agents)} actions, one for each agent; got {shown(action)}"
            ) from error
        return {agent: pairs[agent] for agent in self._live}

    def _see(self, agents: Sequence[Any], observations: Mapping[Any, Any], infos: Mapping[Any, Any]) -> None:
        """Keep what these agents observe."""
        for agent in agents:
            if agent in observations:
                observation, mask = self.readers[agent](observations[agent], infos.get(agent) or {})
                self._seen[agent], self._masks[agent] = _fresh(observation), mask
                if mask is not None:
                    self._widths[agent] = mask.size
            elif agent in self._live:
                raise ProblemError(f"{self.env} must return an observation of every agent in it; none came of {agent}")

    def _observation(self) -> tuple[Any, ...]:
        return tuple(_fresh(self._seen[agent]) for agent in self.possible_agents)

    def _info(self, infos: Mapping[Any, Any], choosers: Sequence[Any]) -> dict[str, Any]:
        """Return the agents' infos and masks: only the `choosers` have more than one action."""
        info: dict[str, Any] = {INFOS: {agent: copy.copy(own) for agent, own in infos.items()}}
        if self._widths:
            info[MASK] = tuple(self._mask(agent, agent in choosers) for agent in self.possible_agents)
        return info

    def _mask(self, agent: Any, chooses: bool) -> NDArray[np.int8] | None:
        if chooses:
            mask = self._masks[agent]
            return None if mask is None else mask.astype(np.int8)  # the type that spaces sample by
        if agent not in self._widths:
            return None
        first_only = np.zeros(self._widths[agent], dtype=np.int8)
        first_only[0] = 1
        return first_only

    def _reward(self, acted: Sequence[Any], rewards: Mapping[Any, float]) -> float:
        try:
            for agent in acted:
                check_reward(rewards[agent])
            paid = {agent: float(rewards[agent]) for agent in acted}
        except KeyError as error:
            raise ProblemError(f"{self.env} must return a reward of every agent; none came of {error}") from error
        if self.reward == "sum":
            return sum(paid.values())
        if self.reward != "mean":
            return paid.get(self.reward, 0.0)
        first, n_agents = paid[acted[0]], len(self.possible_agents)
        if len(paid) == n_agents and all(reward == first for reward in paid.values()):
            return first  # three times 0.1 over three is not 0.1
        return sum(paid.values()) / n_agents


def _fresh(observation: Any) -> Any:
    """Return a copy: Gymnasium's users keep what they observed, PettingZoo's environments may reuse it."""
    return observation if isinstance(observation, (int, np.generic)) else copy.deepcopy(observation)


def innermost(env: Any) -> Any:
    """Return an environment without its wrappers; of a joint one, the parallel environment in it."""
    inner = env.unwrapped
    return inner.env.unwrapped if isinstance(inner, JointEnv) else inner


def agents_of(env: Any) -> list[Any]:
    """Return the possible agents of a parallel environment.

    Raises
    ------
    ProblemError
        If there are none, one is there twice, or one has no spaces.
    """
    agents = list(getattr(env, "possible_agents", None) or ())
    if not agents:
        raise ProblemError(
            f"{env} must list all agents that it may have as `possible_agents`: learning needs to know them at once"
        )
    if len(set(agents)) < len(agents):
        raise ProblemError(f"the possible_agents of {env} must be different; got {agents}")
    for agent in agents:
        try:
            env.observation_space(agent), env.action_space(agent)
        except (AttributeError, KeyError, NotImplementedError) as error:  # as PettingZoo's own methods raise
            raise ProblemError(
                f"{env} has no spaces of its agent {shown(agent)}: let its methods observation_space and action_space "
                "return them"
            ) from error
    return agents
