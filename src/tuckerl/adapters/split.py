"""A Gymnasium environment over joint observations and joint actions as a PettingZoo parallel environment.

The inverse is :mod:`tuckerl.adapters.joint`.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from pettingzoo import ParallelEnv

from tuckerl.adapters.joint import INFOS
from tuckerl.adapters.making import check_spaces
from tuckerl.adapters.masks import MASK
from tuckerl.adapters.step_results import as_flag, check_reward, step_result
from tuckerl.checks import check_actions, check_sequence, shown
from tuckerl.errors import ObservationError, ParameterError, ParameterTypeError, ProblemError

Space = gymnasium.Space[Any]
Step = tuple[dict[str, Any], dict[str, float], dict[str, bool], dict[str, bool], dict[str, dict[str, Any]]]


class SplitEnv(ParallelEnv):  # type: ignore[misc]  # PettingZoo's class is Any to the type checker
    """A Gymnasium environment over joint observations and actions as a PettingZoo parallel environment.

    The inverse of :class:`JointEnv`: every agent receives the one reward, or its own where the environment pays a
    sequence with one for each, and all leave together.

    Parameters
    ----------
    env : gymnasium.Env
        Its observations and its actions must be Tuples of one length: one element for each agent.
    agents : sequence of str, optional
        The agents' names; default: those of the :class:`JointEnv` in `env`, else ``agent_0``, ``agent_1``, ...

    Attributes
    ----------
    env : gymnasium.Env
    possible_agents : list of str
    observation_spaces, action_spaces : dict
        Of each agent.

    Raises
    ------
    ParameterTypeError
        If `env` is no Gymnasium environment.
    ProblemError
        If its spaces are no Tuples of one length.
    ParameterError
        If there is not one name for each agent.

    Notes
    -----
    An agent's info is the environment's, with the agent's part of a tuple ``"action_mask"`` and of ``"infos"``.

    Examples
    --------
    >>> import gymnasium, pettingzoo, tuckerl
    >>> joint = tuckerl.JointEnv(pettingzoo.make("parallel", "tuckerl/RobotRescue-v0"))
    >>> env = tuckerl.SplitEnv(gymnasium.wrappers.TimeLimit(joint, 100))
    >>> env.possible_agents
    ['robot_0', 'robot_1']
    """

    def __init__(self, env: gymnasium.Env[Any, Any], agents: Sequence[str] | None = None) -> None:
        if not isinstance(env, gymnasium.Env):
            raise ParameterTypeError(f"env must be a Gymnasium environment; got {shown(env)}")
        check_spaces(env)
        self.env = env
        observed, acted = _parts(env)
        inner_names = tuple(getattr(env.unwrapped, "possible_agents", ()))
        if len(inner_names) != len(acted):
            inner_names = tuple(f"agent_{place}" for place in range(len(acted)))
        self._inner_names = inner_names  # the names that the agents have in the infos of `env`
        self.possible_agents = list(inner_names) if agents is None else _check_names(agents, len(acted))
        self.agents: list[str] = []
        self.observation_spaces: dict[str, Space] = dict(zip(self.possible_agents, observed, strict=True))
        self.action_spaces: dict[str, Space] = dict(zip(self.possible_agents, acted, strict=True))
        self.metadata = {"name": str(env), **env.metadata}
        self.render_mode = env.render_mode

    def observation_space(self, agent: str) -> Space:
        """Return what one agent may observe, always the same object."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> Space:
        """Return what one agent may do, always the same object."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
        """Begin an episode of all agents.

        Raises
        ------
        ObservationError
            If the observation has not one part for each agent.
        """
        observation, info = self.env.reset(seed=seed, options=options)
        self.agents = self.possible_agents[:]
        return self._observations(observation), self._infos(info)

    def step(self, actions: Mapping[str, Any]) -> Step:
        """Let all agents act at once.

        Raises
        ------
        ResetNeeded
            If no episode is under way.
        ParameterError
            If it is not one action for each agent.
        ObservationError
            If the observation has not one part for each agent.
        ProblemError
            If the environment returns anything else than Gymnasium asks for, or rewards of another number.
        """
        agents = self.agents
        if not agents:
            raise ResetNeeded("call reset() before step(): no episode is under way")
        check_actions(actions, agents)
        joint = tuple(actions[agent] for agent in agents)
        observation, reward, *ends, info = step_result(self.env.step(joint))
        terminated, truncated = map(as_flag, ("terminated", "truncated"), ends)
        if terminated or truncated:
            self.agents = []
        return (
            self._observations(observation),
            self._rewards(agents, reward),
            dict.fromkeys(agents, terminated),
            dict.fromkeys(agents, truncated),
            self._infos(info),
        )

    def render(self) -> Any:
        """Return what the joint environment's own ``render`` returns."""
        return self.env.render()

    def close(self) -> None:
        """Close the joint environment."""
        self.env.close()

    def _observations(self, observation: Any) -> dict[str, Any]:
        if not isinstance(observation, (tuple, list)) or len(observation) != len(self.possible_agents):
            raise ObservationError(
                f"the observations of {self.env} must have {len(self.possible_agents)} parts, as their space says; "
                f"got {shown(observation)}"
            )
        return dict(zip(self.possible_agents, observation, strict=True))

    def _rewards(self, agents: Sequence[str], reward: Any) -> dict[str, float]:
        paid = reward.tolist() if isinstance(reward, np.ndarray) else reward
        rewards = paid if isinstance(paid, (tuple, list)) and len(paid) == len(agents) else [paid] * len(agents)
        for one in rewards:
            check_reward(one)
        return dict(zip(agents, map(float, rewards), strict=True))

    def _infos(self, info: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
        shared, infos, masks = dict(info), info.get(INFOS), info.get(MASK)
        infos = shared.pop(INFOS) if isinstance(infos, Mapping) else {}
        n_agents = len(self.possible_agents)
        masks = shared.pop(MASK) if isinstance(masks, (tuple, list)) and len(masks) == n_agents else [None] * n_agents
        return {
            agent: {**shared, **infos.get(name, {}), **({} if mask is None else {MASK: mask})}
            for agent, name, mask in zip(self.possible_agents, self._inner_names, masks, strict=True)
        }


def _check_names(agents: Sequence[str], n_agents: int) -> list[str]:
    expected = f"{n_agents} different names"
    names = [name for name in check_sequence("agents", agents, expected) if isinstance(name, str)]
    if len(agents) != n_agents or len(set(names)) != n_agents:
        raise ParameterError(f"agents must be {expected}; got {shown(agents)}")
    return names


def _parts(env: gymnasium.Env[Any, Any]) -> tuple[Sequence[Space], Sequence[Space]]:
    """Return the Tuple spaces of observations and of actions."""
    observed, acted = env.observation_space, env.action_space
    if not (isinstance(observed, spaces.Tuple) and isinstance(acted, spaces.Tuple)) or not len(observed) == len(acted):
        raise ProblemError(
            f"the observation and action spaces of {env} must be Tuples of one length, a part for each agent; got "
            f"{observed} and {acted}"
        )
    if not len(acted):
        raise ProblemError(f"the spaces of {env} must have a part for each agent; got {observed} and {acted}")
    return observed.spaces, acted.spaces
