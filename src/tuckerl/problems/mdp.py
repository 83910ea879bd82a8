"""A finite Markov decision process as arrays: the form in which every table of transitions reaches a kernel.

States and actions are numbered from 0. A pair (s, a) has one outcome or several; outcome ``k`` leads to
``next_state[k]``, pays ``reward[k]`` and, where ``terminated[k]``, ends the return: nothing is bootstrapped from its
next state. (Puterman, *Markov Decision Processes*, 1994; Sutton and Barto, *Reinforcement Learning*, 2018, 3.1.)
"""

from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple, NotRequired, Self, TypedDict

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tuckerl.errors import ParameterError, ParameterTypeError, ProblemError, SavedFileError
from tuckerl.problems.immutable import seal
from tuckerl.problems.outcomes import check_mask, check_outcomes, check_start, joined_outcomes, read_transitions
from tuckerl.problems.parts import NO_LIMIT, Layout, as_array, check_limit
from tuckerl.problems.problem import Arrays, Header, Problem, not_the_saved
from tuckerl.problems.worlds import World
from tuckerl.saved_arrays import SavedArrays
from tuckerl.saved_json import checked_json
from tuckerl.spaces.description import Description, digest
from tuckerl.types import BoolArray, FloatArray, IntArray, StateArray

# One record instead of three arrays: a step finds its outcome in memory once.
OUTCOME = np.dtype([("reward", np.float64), ("next_state", np.uint32), ("terminated", np.bool_)], align=True)


class MDPArrays(NamedTuple):
    """What kernels read of an MDP with S states, A actions and M outcomes in all, made by `mdp_arrays`.

    Where every pair has exactly one outcome, that of (s, a) is ``s * A + a`` and `offsets` and `cumulative` are empty;
    otherwise its outcomes are ``offsets[s * A + a]`` up to ``offsets[s * A + a + 1]``, and `cumulative` holds their
    summed probabilities.
    """

    outcomes: NDArray[np.void]  # (M,) of OUTCOME
    offsets: IntArray  # (S * A + 1,) or (0,)
    cumulative: FloatArray  # (M,) or (0,)
    start_state: StateArray  # (K,)
    start_cumulative: FloatArray  # (K,)
    action_mask: BoolArray  # (S, A) True where an action may be taken, or (0, 0) where all may
    n_actions: int
    max_episode_steps: int  # NO_LIMIT where there is none

    @property
    def next_state(self) -> StateArray:
        """The state that each outcome leads to, (M,)."""
        return self.outcomes["next_state"]

    @property
    def reward(self) -> FloatArray:
        """What each outcome pays, (M,)."""
        return self.outcomes["reward"]

    @property
    def terminated(self) -> BoolArray:
        """Whether the return ends with an outcome, (M,)."""
        return self.outcomes["terminated"]


def mdp_arrays(next_state: NDArray[Any], reward: NDArray[Any], terminated: NDArray[Any], **others: Any) -> MDPArrays:
    """Return the arrays of an MDP whose M outcomes are given one array for each part, (M,).

    Parameters
    ----------
    next_state : (M,) int
    reward : (M,) float
    terminated : (M,) bool
    **others
        The fields of :class:`MDPArrays` but its outcomes.
    """
    outcomes = np.zeros(next_state.size, dtype=OUTCOME)
    outcomes["next_state"], outcomes["reward"], outcomes["terminated"] = next_state, reward, terminated
    return MDPArrays(outcomes, **others)


class _StoredMDP(TypedDict):
    """What a file holds of an MDP beside its arrays; format 1 holds no more than the first four."""

    n_states: int
    n_actions: int
    max_episode_steps: int
    action_sizes: list[int]
    layout: NotRequired[tuple[int, int] | None]
    is_capped: NotRequired[bool]
    source: NotRequired[str | None]
    action_names: NotRequired[list[str]]
    state_factors: NotRequired[list[tuple[str, int]]]


class TabularMDP(Problem):
    """A finite MDP, checked once and kept as read-only arrays.

    Parameters
    ----------
    next_state : (S, A) or (S, A, K) int
        The state that each outcome leads to.
    reward : the same shape, float
    terminated : the same shape, bool
        True where the outcome ends the episode.
    probability : (S, A, K) float, optional
        Needed with K outcomes; each pair's sum to 1. Outcomes of probability 0 are dropped.
    start : int or (S,) float, optional
        The first state, or the probability of each. Default 0.
    max_episode_steps : int, optional
        An episode is truncated after as many steps; default: never.
    heuristic : (S,) float, optional
        What ``DynaH`` uses by default: larger is farther from the goal.
    action_sizes : tuple of int, optional
        Where an action is a joint one: how many actions each agent has. Joint actions are numbered by C-order
        ``ravel_multi_index`` over the agents. Default: one agent, ``(A,)``.
    action_mask : (S, A) bool, optional
        True where an action may be taken: learners choose among those only. A state in which none may is one in which
        all may. Default: all.
    layout, action_names, state_factors
        See :class:`~tuckerl.problems.problem.Problem`.

    Raises
    ------
    ProblemError
        If shapes differ, a state is out of range, a number is not finite, probabilities do not sum to 1, or a part
        does not fit S or A.

    Examples
    --------
    >>> chain = TabularMDP([[0, 1], [0, 1]], [[0, 1], [0, 0]], [[False, True], [True, True]])
    >>> chain.n_states, chain.n_actions
    (2, 2)
    """

    kind = "table"
    title = "transition table"
    how_played = "extracted transition table, compiled"
    is_data = True

    def __init__(
        self,
        next_state: ArrayLike,
        reward: ArrayLike,
        terminated: ArrayLike,
        probability: ArrayLike | None = None,
        *,
        start: int | ArrayLike = 0,
        max_episode_steps: int | None = None,
        heuristic: ArrayLike | None = None,
        action_sizes: Sequence[int] | None = None,
        action_mask: ArrayLike | None = None,
        layout: Layout | None = None,
        action_names: Sequence[str] | None = None,
        state_factors: Sequence[tuple[str, int]] | None = None,
    ) -> None:
        outcomes = {"next_state": next_state, "reward": reward, "terminated": terminated}
        states, rewards, ends = (as_array(name, values) for name, values in outcomes.items())
        check_outcomes(states, rewards, ends, with_probability=probability is not None)
        super().__init__(
            *map(int, states.shape[:2]),
            max_episode_steps=max_episode_steps,
            heuristic=heuristic,
            layout=layout,
            action_sizes=action_sizes,
            action_names=action_names,
            state_factors=state_factors,
        )
        start_state, start_cumulative = check_start(start, self.n_states)
        kept, offsets, cumulative = joined_outcomes(states, probability)
        self.arrays = mdp_arrays(
            states[kept],
            rewards[kept],
            ends[kept],
            offsets=offsets,
            cumulative=cumulative,
            start_state=start_state,
            start_cumulative=start_cumulative,
            action_mask=check_mask(action_mask, states.shape[:2]),
            n_actions=self.n_actions,
            max_episode_steps=self.max_episode_steps or NO_LIMIT,
        )

    @classmethod
    def from_arrays(
        cls,
        arrays: MDPArrays,
        n_states: int,
        heuristic: FloatArray | None = None,
        action_sizes: Sequence[int] | None = None,
        layout: Layout | None = None,
        **parts: Any,
    ) -> Self:
        """Return the MDP whose `arrays` were taken from another one (they are not checked again).

        Parameters
        ----------
        arrays : MDPArrays
        n_states : int
        heuristic, action_sizes, layout, **parts
            See :class:`~tuckerl.problems.problem.Problem`.
        """
        mdp, limit = cls.__new__(cls), arrays.max_episode_steps
        parts |= {"heuristic": heuristic, "action_sizes": action_sizes, "layout": layout}
        Problem.__init__(mdp, n_states, arrays.n_actions, max_episode_steps=limit, **parts)
        mdp.arrays = arrays
        seal(mdp)
        return mdp

    def world(self) -> World:
        """Return a world for one agent; all may read the same arrays."""
        # Its kernels are loaded here: an environment that looks its steps up in this table needs no compiler.
        import_module("tuckerl.problems.mdp_kernels")
        return World(self.arrays, (self.arrays.action_mask,))

    def with_time_limit(self, max_episode_steps: int | None, *, is_capped: bool = False) -> Self:
        """Return the same MDP (sharing its arrays) with another limit on an episode's steps."""
        limit = check_limit(max_episode_steps)
        arrays = self.arrays._replace(max_episode_steps=limit or NO_LIMIT)
        return self._replace(arrays=arrays, max_episode_steps=limit, is_capped=is_capped)

    @property
    def action_mask(self) -> BoolArray | None:
        """Where an action may be taken, (S, A); None where all may."""
        return self.arrays.action_mask if self.arrays.action_mask.size else None

    @property
    def largest_reward(self) -> float:
        """The largest reward of an outcome."""
        return float(self.arrays.reward.max())

    def start_distribution(self) -> tuple[NDArray[Any], FloatArray]:
        """Return the states in which episodes may begin, (K,), and their probabilities, (K,)."""
        return self.arrays.start_state, np.diff(self.arrays.start_cumulative, prepend=0.0)

    def unreachable_states(self) -> BoolArray | None:
        """Return the states that no start leads to, (S,); None where there is none."""
        arrays, pairs = self.arrays, self.n_states * self.n_actions
        offsets = arrays.offsets if arrays.offsets.size else np.arange(pairs + 1)
        origin = np.repeat(np.arange(pairs) // self.n_actions, np.diff(offsets))
        reached, n_before = np.zeros(self.n_states, dtype=np.bool_), 0
        reached[arrays.start_state] = True
        while (n_reached := int(np.count_nonzero(reached))) > n_before:
            n_before = n_reached
            reached[arrays.next_state[reached[origin] & ~arrays.terminated]] = True
        reached[arrays.next_state[reached[origin]]] = True  # an episode may end in a state that none goes on from
        return None if reached.all() else ~reached

    def description(self) -> Description:
        """Return all that makes this MDP the one that it is, as JSON: its arrays by their digests."""
        arrays = self.arrays
        outcomes = (arrays.next_state, arrays.reward, arrays.terminated, arrays.offsets, arrays.cumulative)
        return super().description() | {
            "transitions": digest(*outcomes),
            "first states": digest(arrays.start_state, arrays.start_cumulative),
            "action mask": digest(arrays.action_mask) if arrays.action_mask.size else None,
            "heuristic": None if self.heuristic is None else digest(self.heuristic),
        }

    def save(self) -> tuple[Header, Arrays]:
        """Return all of the MDP."""
        parts = self.arrays._asdict() | {name: getattr(self.arrays, name) for name in OUTCOME.names or ()}
        del parts["outcomes"]
        arrays = {name: part for name, part in parts.items() if isinstance(part, np.ndarray)}
        header = {name: part for name, part in parts.items() if name not in arrays}
        header |= {"n_states": self.n_states, "action_sizes": list(self.action_sizes), "layout": self.layout}
        header |= {"is_capped": self.is_capped, "source": self.source}
        optional = {"action_names": self._action_names, "state_factors": self._state_factors}
        header |= {name: part for name, part in optional.items() if part is not None}
        return header, arrays if self.heuristic is None else arrays | {"heuristic": self.heuristic}

    @classmethod
    def restore(
        cls, header: Header, arrays: SavedArrays, given: Any, resolve: Callable[..., Problem], path: Path
    ) -> "TabularMDP":
        """Return the MDP that `save` took apart, checked anew; files of format 1 hold no layout or source.

        The file holds all of it: an environment that is given is only compared.
        """
        try:
            held = checked_json(header, _StoredMDP, "the table")
            parts = read_transitions(arrays, held["n_states"], held["n_actions"])
            layout = held.get("layout")
            mdp = cls.from_arrays(
                mdp_arrays(**parts, n_actions=held["n_actions"], max_episode_steps=held["max_episode_steps"]),
                held["n_states"],
                arrays.take("heuristic", np.float64, (held["n_states"],)) if "heuristic" in arrays else None,
                held["action_sizes"],
                None if layout is None else (layout[0], layout[1]),
                is_capped=held.get("is_capped", False),
                source=held.get("source"),
                action_names=held.get("action_names"),
                state_factors=held.get("state_factors"),
            )
        except (SavedFileError, ProblemError, ParameterError, ParameterTypeError) as error:
            raise SavedFileError(f"{path} holds no sound table: {error}") from error
        difference = None if given is None else mdp.difference(resolve(given))
        if difference:
            raise not_the_saved(path, difference)
        return mdp

    def __repr__(self) -> str:
        return (
            f"TabularMDP({self.n_states} states, {self.n_actions} actions, {self.arrays.next_state.size} outcomes, "
            f"max_episode_steps={self.max_episode_steps})"
        )
