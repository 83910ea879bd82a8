"""What a problem says of itself, by which files know it again and learners know what they may be judged on."""

from typing import ClassVar

from gymnasium.spaces import Discrete, Tuple

from tuckerl.problems.immutable import Immutable
from tuckerl.spaces.description import Description, describe_space, first_difference, numbered


class Described(Immutable):
    """The part of a problem that compares it with others; see :class:`~tuckerl.problems.problem.Problem`."""

    kind: ClassVar[str]
    is_compiled: ClassVar[bool]
    shares_world: ClassVar[bool]

    n_states: int
    n_actions: int
    action_sizes: tuple[int, ...]
    max_episode_steps: int | None
    is_capped: bool

    def spaces_description(self) -> Description:
        """Return what is observed and done, as JSON; see :func:`tuckerl.spaces.description.describe_space`."""
        sizes = self.action_sizes
        action = Discrete(self.n_actions) if len(sizes) == 1 else Tuple(map(Discrete, sizes))
        return {"observation": describe_space(Discrete(self.n_states)), "action": describe_space(action)}

    def description(self) -> Description:
        """Return all that makes this problem the one that it is, and is no code, as JSON."""
        limit = None if self.is_capped else self.max_episode_steps  # a cap is learners' own
        return {"kind": self.kind} | self.spaces_description() | {"time limit": limit}

    def difference(self, other: "Described") -> str | None:
        """Return the first thing in which another problem differs from this one; None where it is the same.

        Functions, and the code of environments, are not compared.

        Examples
        --------
        >>> from tuckerl import sutton_maze
        >>> maze = sutton_maze().to_mdp()
        >>> maze.difference(maze.with_time_limit(9))
        'time limit was 2000; got 9'
        """
        return first_difference(self.description(), other.description())

    def difference_of_spaces(self, other: "Described") -> str | None:
        """Return the first thing in which another problem's spaces, agents or bins differ; None if they are the same.

        The states and actions of a problem that is played in compiled code are numbers, also where it is a joint one.
        """
        before, now = self.spaces_description(), other.spaces_description()
        if (self.is_compiled or other.is_compiled) and not (self.shares_world or other.shares_world):
            before, now = ({key: numbered(each[key]) for key in ("observation", "action")} for each in (before, now))
        return first_difference(before, now)
