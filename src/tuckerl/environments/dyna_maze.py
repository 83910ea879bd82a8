"""The DYNA maze as a Gymnasium environment, ``tuckerl/DynaMaze-v0`` (the paper's section IV.B, Figures 10 and 11).

An agent looks for the way from the start to the goal of a grid world whose walls it does not know. Every step pays -1,
the one into the goal pays 0 and ends the episode; a step against a wall or the border does not move.
"""

from typing import Any

import gymnasium
from gymnasium.error import ResetNeeded
from numpy.typing import ArrayLike

from tuckerl.checks import check_int, shown
from tuckerl.environments.maze_view import draw_maze, write_maze
from tuckerl.environments.raster import RENDER_MODES, check_render_mode, rendered
from tuckerl.errors import ParameterError
from tuckerl.problems.maze import ACTION_NAMES, Cell, Maze, check_walls, random_maze


class DynaMazeEnv(gymnasium.Env[Any, Any]):
    """A maze whose cells are the observations and whose four moves are the actions.

    Observation ``row * columns + column``; actions 0 up, 1 down, 2 left, 3 right.

    Parameters
    ----------
    walls : (rows, columns) bool, optional
        True where nobody can stand; taken as it is. By default a world is drawn by the four parameters that follow.
    rows, columns : int
        The size of a drawn world.
    deviation : float
        A cell of a drawn world is a wall when a normal draw with this standard deviation, rounded, is not 0.
    maze_seed : int
        The number of the drawn world.
    start, goal : (row, column)
    render_mode : {"ansi", "rgb_array"}, optional
        ``render`` returns a string or a (height, width, 3) uint8 image.

    Attributes
    ----------
    maze : Maze
    mdp : TabularMDP
        The transitions that ``step`` takes. The limit of 2000 steps is not in it: ``gymnasium.make`` adds that.
    action_names : tuple of str

    Raises
    ------
    MazeError
        If start or goal is outside or a wall, both are the same cell, or no path joins them.

    Examples
    --------
    >>> import gymnasium, tuckerl
    >>> env = gymnasium.make("tuckerl/DynaMaze-v0", maze_seed=1)
    >>> env.reset()
    (3, {})
    >>> env.step(1)
    (39, -1.0, False, False, {})
    """

    metadata = {"render_modes": RENDER_MODES, "render_fps": 10}  # noqa: RUF012  # as Gymnasium types it
    action_names = ACTION_NAMES

    def __init__(
        self,
        walls: ArrayLike | None = None,
        rows: int = 39,
        columns: int = 36,
        deviation: float = 0.3,
        maze_seed: int = 0,
        start: Cell = (0, 3),
        goal: Cell = (28, 34),
        render_mode: str | None = None,
    ) -> None:
        self.render_mode = check_render_mode(render_mode)
        if walls is None:
            seed = check_int("maze_seed", maze_seed, 0)
            self.maze = random_maze(rows, columns, deviation, seed, start=start, goal=goal)
        else:
            self.maze = Maze(check_walls(walls), start, goal)
        self.mdp = self.maze.to_mdp(max_episode_steps=None)
        self.observation_space = gymnasium.spaces.Discrete(self.mdp.n_states)
        self.action_space = gymnasium.spaces.Discrete(self.mdp.n_actions)
        self._state: int | None = None
        # Pairs of states, the lower first (a bump's twice the same): bounded by the maze however long an episode runs.
        self._walked: set[tuple[int, int]] = set()

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[int, dict[str, Any]]:
        """Return to the start; `seed` and `options` change nothing, as nothing is random."""
        super().reset(seed=seed)
        self._state = self.maze.state(self.maze.start)
        self._walked.clear()
        return self._state, {}

    def step(self, action: int) -> tuple[int, float, bool, bool, dict[str, Any]]:
        """Move up (0), down (1), left (2) or right (3), if no wall is there.

        Raises
        ------
        ParameterError
            If there is no such action.
        """
        if self._state is None:
            raise ResetNeeded("call reset() before step(): no episode has begun")
        if not self.action_space.contains(action):
            raise ParameterError(f"action must be 0 (up), 1 (down), 2 (left) or 3 (right); got {shown(action)}")
        arrays = self.mdp.arrays
        outcome = self._state * self.mdp.n_actions + int(action)
        before, self._state = self._state, int(arrays.next_state[outcome])
        self._walked.add((min(before, self._state), max(before, self._state)))
        return self._state, float(arrays.reward[outcome]), bool(arrays.terminated[outcome]), False, {}

    def render(self) -> Any:
        """Return the maze, the path walked in this episode and the agent, as `render_mode` asks."""
        agent = self.maze.start if self._state is None else self.maze.cell(self._state)
        scene = self.maze, [(self.maze.cell(a), self.maze.cell(b)) for a, b in sorted(self._walked)], agent
        return rendered(self.render_mode, lambda: write_maze(*scene), lambda: draw_maze(*scene))
