"""Robot rescue as a PettingZoo parallel environment, ``tuckerl/RobotRescue-v0`` (the paper's section IV.C, Figure 13).

Two robots bring an object home together. The rules are those of :mod:`tuckerl.environments.robot_rescue`: an episode is
played by looking its steps up in that module's table.
"""

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded
from pettingzoo import ParallelEnv

from tuckerl.checks import check_actions, check_int, shown
from tuckerl.environments.raster import RENDER_MODES, check_render_mode, rendered
from tuckerl.environments.robot_rescue import GRIPS, robot_rescue, scene
from tuckerl.environments.robot_rescue_map import ACTION_NAMES, AGENTS, MOVES, RescueMap, as_rescue_map
from tuckerl.environments.robot_rescue_view import draw_rescue, write_rescue
from tuckerl.errors import ParameterError
from tuckerl.problems.mdp import TabularMDP
from tuckerl.types import IntArray

Step = tuple[dict[str, np.int64], dict[str, float], dict[str, bool], dict[str, bool], dict[str, dict[str, Any]]]


class RobotRescueEnv(ParallelEnv):  # type: ignore[misc]  # PettingZoo's class is Any to the type checker
    """Two robots, ``robot_0`` and ``robot_1``, that must take hold of an object from both sides and carry it home.

    Each observes itself, ``cell * 3 + grip`` (grip: 0 free, 1 the object is on its right, 2 on its left), chooses
    among 0 left, 1 right, 2 up, 3 down and 4 stay, and receives the team's reward. ``state()`` is the number of the
    joint state.

    Parameters
    ----------
    map : RescueMap, str or list of str, optional
        Where everything is at first, as :class:`~tuckerl.environments.robot_rescue_map.RescueMap` reads it; by default
        a map of 8 x 8 cells.
    step_cost, grip_reward, delivery_reward : float
        What every step costs, and what each grip and the delivery pay the team.
    max_cycles : int, optional
        An episode is truncated after as many steps; None: never. (PettingZoo's ``make`` takes -1 for never.)
    render_mode : {"ansi", "rgb_array"}, optional
        ``render`` returns a string or a (height, width, 3) uint8 image.

    Attributes
    ----------
    map : RescueMap
    mdp : TabularMDP
        The joint transitions that ``step`` takes, `max_cycles` as their limit.
    action_names : tuple of str
        Of each robot.

    Raises
    ------
    ProblemError
        If the map cannot be used.

    Examples
    --------
    >>> import pettingzoo, tuckerl
    >>> env = pettingzoo.make("parallel", "tuckerl/RobotRescue-v0")
    >>> observations, infos = env.reset()
    >>> int(observations["robot_0"]), int(observations["robot_1"]), int(env.state())
    (168, 189, 32445)
    >>> env.step({"robot_0": 2, "robot_1": 2})[1]
    {'robot_0': 0.0, 'robot_1': 0.0}
    """

    metadata: dict[str, Any] = {  # noqa: RUF012  # as PettingZoo types it
        "name": "RobotRescue-v0",
        "render_modes": RENDER_MODES,
        "render_fps": 10,
        "is_parallelizable": True,
    }
    action_names = ACTION_NAMES

    def __init__(
        self,
        map: RescueMap | str | Sequence[str] | None = None,  # noqa: A002  # the contract's word
        *,
        step_cost: float = 0.0,
        grip_reward: float = 1.0,
        delivery_reward: float = 10.0,
        max_cycles: int | None = 1000,
        render_mode: str | None = None,
    ) -> None:
        self.render_mode = check_render_mode(render_mode)
        self.map = as_rescue_map(map)
        self.mdp: TabularMDP = robot_rescue(
            self.map,
            step_cost=step_cost,
            grip_reward=grip_reward,
            delivery_reward=delivery_reward,
            max_episode_steps=None,
        )
        self.max_cycles = max_cycles
        self.possible_agents = list(AGENTS)
        self.agents: list[str] = []
        self.observation_spaces = {
            agent: gymnasium.spaces.Discrete(self.map.n_cells * GRIPS) for agent in self.possible_agents
        }
        self.action_spaces = {agent: gymnasium.spaces.Discrete(len(MOVES)) for agent in self.possible_agents}
        self.state_space = gymnasium.spaces.Discrete(self.mdp.n_states)
        self._state = int(self.mdp.arrays.start_state[0])
        self._steps = 0

    @property
    def max_cycles(self) -> int | None:
        """Steps after which an episode is truncated; PettingZoo's checks set it on a finished environment."""
        return self.mdp.max_episode_steps

    @max_cycles.setter
    def max_cycles(self, steps: int | None) -> None:
        limit = None if steps is None else check_int("max_cycles", steps, 1)
        self.mdp = self.mdp.with_time_limit(limit)

    def observation_space(self, agent: str) -> gymnasium.spaces.Discrete:
        """Return what one robot may observe, always the same object."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> gymnasium.spaces.Discrete:
        """Return what one robot may do, always the same object."""
        return self.action_spaces[agent]

    def state(self) -> IntArray:
        """Return the number of the joint state, an array without axes; each robot observes one part of it."""
        return np.array(self._state)

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, np.int64], dict[str, dict[str, Any]]]:
        """Put everything back to its first cell; `seed` and `options` change nothing, as nothing is random."""
        self.agents = self.possible_agents[:]
        self._state = int(self.mdp.arrays.start_state[0])
        self._steps = 0
        return self._observations(), {agent: {} for agent in self.agents}

    def step(self, actions: dict[str, int]) -> Step:
        """Move both robots at once; each goes left (0), right (1), up (2), down (3) or stays (4).

        Raises
        ------
        ParameterError
            If a robot's action is missing or there is no such action.
        """
        if not self.agents:
            raise ResetNeeded("call reset() before step(): no episode is under way")
        arrays = self.mdp.arrays
        outcome = self._state * self.mdp.n_actions + self._joint_action(actions)
        self._state = int(arrays.next_state[outcome])
        self._steps += 1
        reward, terminated = float(arrays.reward[outcome]), bool(arrays.terminated[outcome])
        truncated = not terminated and self._steps >= arrays.max_episode_steps
        agents = self.agents
        if terminated or truncated:
            self.agents = []
        return (
            self._observations(),
            dict.fromkeys(agents, reward),
            dict.fromkeys(agents, terminated),
            dict.fromkeys(agents, truncated),
            {agent: {} for agent in agents},
        )

    def render(self) -> Any:
        """Return the world as it is now, as `render_mode` asks."""
        now = scene(self.map, self._state)
        return rendered(self.render_mode, lambda: write_rescue(self.map, now), lambda: draw_rescue(self.map, now))

    def _observations(self) -> dict[str, np.int64]:
        # The type that the space's own samples have: PettingZoo's check of the converted environment asks for it.
        own = (np.int64(number) for number in divmod(self._state, self.map.n_cells * GRIPS))
        return dict(zip(self.possible_agents, own, strict=True))

    def _joint_action(self, actions: dict[str, int]) -> int:
        check_actions(actions, self.agents)
        joint = 0
        for agent in self.agents:
            action = actions[agent]
            if not self.action_spaces[agent].contains(action):
                raise ParameterError(
                    f"the action of {agent} must be 0 (left), 1 (right), 2 (up), 3 (down) or 4 (stay); got "
                    f"{shown(action)}"
                )
            joint = joint * len(MOVES) + int(action)
        return joint


def parallel_env(*, max_cycles: int | None = None, **parameters: Any) -> RobotRescueEnv:
    """Return the environment as PettingZoo's registry makes it: without a limit if the registry gives none."""
    return RobotRescueEnv(max_cycles=max_cycles, **parameters)
