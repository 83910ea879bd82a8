"""The interface of a problem, whatever its kind: its sizes, worlds to play in, names, descriptions, and saving.

A kind of problem is one file with a subclass of :class:`Problem`, a NamedTuple of what kernels read of it, and its
kernels, which :func:`tuckerl.problems.dynamics.register_dynamics` lists. One line in
:data:`tuckerl.adapters.kinds.PROBLEM_KINDS` lets saved files find it.
"""

from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Self

from numpy.typing import ArrayLike, NDArray

from tuckerl.checks import check_int
from tuckerl.errors import ParameterError
from tuckerl.problems.action_masks import Batch, as_mask, joint_mask, masks_of_parts
from tuckerl.problems.described import Described
from tuckerl.problems.parts import (
    STEP_CAP,
    Layout,
    StateFactor,
    check_action_names,
    check_action_sizes,
    check_heuristic,
    check_layout,
    check_limit,
    check_state_factors,
    check_states,
)
from tuckerl.problems.worlds import World
from tuckerl.saved_arrays import SavedArrays
from tuckerl.spaces.description import first_difference
from tuckerl.types import BoolArray, FloatArray

GIVE_ENV = "pass load() its env, or name it with --env in a command"

Header = dict[str, Any]
Arrays = dict[str, NDArray[Any]]
"""What a saved file holds: JSON, and arrays by name."""

Choose = Callable[[int, NDArray[Any], BoolArray | None], NDArray[Any]]
"""``choose(table, states, action_masks)`` returns an action for each state, by one agent's table; the masks, (..., A)
bool, are those that were given or that the observations carried, or None. They may lack a table's last actions, which
an agent with fewer than others does not have."""

Decide = Callable[[Any, Choose, Any], Any]
"""As :meth:`Problem.decide`."""


class Problem(Described):
    """A problem that learners can play; it does not change once it is made.

    Attributes that a subclass assigns in its constructor do not change either, and its arrays are read-only.

    Parameters
    ----------
    n_states, n_actions : int
        Rows and columns of a table.
    max_episode_steps : int, optional
        An episode is truncated after as many steps; default: never.
    is_capped : bool
        Whether that limit is this library's, because the environment has none.
    source : str, optional
        What the environment is called that this was made of.
    heuristic : (n_states,) float, optional
        What ``DynaH`` uses by default: larger is farther from the goal.
    layout : (rows, columns), optional
        The grid whose cells the states are, row by row: figures draw states in this plane.
    action_sizes : tuple of int, optional
        How many actions each agent has, where an action is a joint one. Default: ``(n_actions,)``.
    action_names : sequence of n_actions str, optional
        Default: "0", "1", ...
    state_factors : sequence of (name, size), optional
        The digits of a state's number, the fastest last. Default: one, "state".

    Attributes
    ----------
    kind : str
        The key of this kind in :data:`tuckerl.adapters.kinds.PROBLEM_KINDS`.
    title, how_played : str
        What this kind is called, and how it is played, in reports.
    is_compiled : bool
        Whether steps are taken in compiled code, so that several learners can share the problem.
    is_data : bool
        Whether a saved file holds all of it; otherwise loading needs the environment.
    shares_world : bool
        Whether all agents act in one world, each with a table of its own.
    agents : tuple
        The names of a multi-agent environment's agents, () otherwise.
    has_equal_spaces : bool
        Whether all agents with tables of their own have equal observation and action spaces.
    id : str or None
        The id by which the environment can be made again, where it was made by one.
    decide_by_agent : callable or None
        Takes the place of `decide` where a joint problem is given a dict by agent, and its agents are known.

    Raises
    ------
    ProblemError
        If a part does not fit the numbers of states and actions.
    ParameterError, ParameterTypeError
        If a number is impossible.
    ImmutableError
        Later, if an attribute is to be assigned or deleted.
    """

    kind: ClassVar[str]
    title: ClassVar[str]
    how_played: ClassVar[str]
    is_compiled: ClassVar[bool] = True
    is_data: ClassVar[bool] = False
    shares_world: ClassVar[bool] = False
    instead: ClassVar[dict[str, str]] = {
        "max_episode_steps": "with_time_limit(steps) returns one with another limit",
        "source": "with_source(source) returns one that is called so",
    }

    agents: tuple[Any, ...] = ()
    has_equal_spaces = True
    id: str | None = None
    decide_by_agent: Decide | None = None

    def __init__(
        self,
        n_states: int,
        n_actions: int,
        *,
        max_episode_steps: int | None = None,
        is_capped: bool = False,
        source: str | None = None,
        heuristic: ArrayLike | None = None,
        layout: Layout | None = None,
        action_sizes: Sequence[int] | None = None,
        action_names: Sequence[str] | None = None,
        state_factors: Sequence[tuple[str, int]] | None = None,
    ) -> None:
        self.n_states, self.n_actions = check_int("n_states", n_states, 1), check_int("n_actions", n_actions, 1)
        self.action_sizes = check_action_sizes(action_sizes, self.n_actions)
        self.max_episode_steps = check_limit(max_episode_steps)
        self.is_capped, self.source = is_capped, source
        self.heuristic = None if heuristic is None else check_heuristic(heuristic, self.n_states)
        self.layout = check_layout(layout, self.n_states)
        self._action_names = check_action_names(action_names, self.n_actions)
        self._state_factors = check_state_factors(state_factors, self.n_states)

    @abstractmethod
    def world(self) -> World:
        """Return a world for one agent, or for all where they share it.

        Raises
        ------
        SimulatorError
            If a function cannot be compiled.
        ProblemError
            If an environment cannot be copied.
        """

    @property
    def action_names(self) -> tuple[str, ...]:
        """What the actions are called."""
        return self._action_names or tuple(map(str, range(self.n_actions)))

    @property
    def state_factors(self) -> tuple[StateFactor, ...]:
        """The digits that a state's number is made of, in C order: their sizes multiply to the number of states."""
        return self._state_factors or (StateFactor("state", self.n_states),)

    @property
    def action_mask(self) -> BoolArray | None:
        """Where an action may be taken, (S, A); None where all may, or where it is not known before playing."""
        return None

    @property
    def largest_reward(self) -> float | None:
        """The largest reward that a step can pay; None where that is not known before playing."""
        return None

    @property
    def world_bytes(self) -> int:
        """Bytes of memory that each world takes, where these are not few."""
        return 0

    @property
    def copy_bytes(self) -> int:
        """Bytes of memory that each world but the first takes besides, as it has a copy of what the first one has."""
        return 0

    def n_tables(self, n_agents: int) -> int:
        """Return how many tables a learner keeps that was asked for `n_agents` agents.

        Raises
        ------
        ParameterError
            If the number of agents is the environment's, and more are asked for.
        """
        return n_agents

    def with_time_limit(self, max_episode_steps: int | None, *, is_capped: bool = False) -> Self:
        """Return the same problem with another limit on an episode's steps."""
        return self._replace(max_episode_steps=check_limit(max_episode_steps), is_capped=is_capped)

    def with_source(self, source: str, id: str | None = None) -> Self:  # noqa: A002  # Gymnasium's word
        """Return the same problem, said to be made of the environment that is called `source`."""
        return self._replace(source=source, id=id)

    def _replace(self, **changes: Any) -> Self:
        other = object.__new__(type(self))
        vars(other).update(vars(self) | changes)  # it is made, as this one is
        return other

    def for_copy(self, worlds: Sequence[World], memo: dict[int, Any]) -> "Problem":
        """Return the problem of a learner's copy, which goes on from these worlds; itself, as nothing changes it.

        Parameters
        ----------
        worlds : sequence of World
            Those of the learner, between two episodes.
        memo : dict
            As of :func:`copy.deepcopy`.
        """
        return self

    def with_agents(self, decide_by_agent: Decide) -> Self:
        """Return the same problem, which takes observations as dicts by agent besides states' numbers."""
        return self._replace(decide_by_agent=decide_by_agent)

    def decide(self, observation: Any, choose: Choose, action_masks: Any = None) -> Any:
        """Return the action that is chosen for what the environment gives, as the environment takes it.

        Parameters
        ----------
        observation
            One observation or a batch; of several agents, a dict by agent. Unless a subclass says otherwise,
            observations are states' numbers and actions are numbers.
        choose : callable
            ``choose(table, states, action_masks)``, see `Choose`; `states` has the shape () or (batch,).
        action_masks : optional
            Where actions may be taken, (..., A), besides what the observations carry: both hold. Of joint actions also
            a tuple of the agents' masks; of several agents, a dict by agent.

        Raises
        ------
        ParameterError, ParameterTypeError, ObservationError
            If the observation is none of the environment's, or a mask none of its actions.
        """
        if self.decide_by_agent is not None and isinstance(observation, Mapping):
            return self.decide_by_agent(observation, choose, action_masks)
        states = check_states(observation, self.n_states)
        chosen = choose(0, states, self._read_masks(action_masks, states.shape))
        return int(chosen) if states.ndim == 0 else chosen

    def _read_masks(self, given: Any, batch: Batch) -> BoolArray | None:
        if given is None:
            return None
        if len(self.action_sizes) > 1 and isinstance(given, tuple) and len(given) == len(self.action_sizes):
            return joint_mask(masks_of_parts(given, self.action_sizes, batch))
        return as_mask(given, self.n_actions, batch)

    def describe(self) -> str:
        """Return in a part of a sentence how the problem is played, and its sizes."""
        sizes = f"{_counted(self.n_states, 'state')}, {_counted(self.n_actions, 'action')}"
        if self.is_compiled:
            return f"its {self.title} ({sizes}) is played in compiled code"
        return f"{self.how_played} ({sizes})"

    def start_distribution(self) -> tuple[NDArray[Any], FloatArray] | None:
        """Return the states in which episodes may begin, and their probabilities; None where these are not known."""
        return None

    def unreachable_states(self) -> BoolArray | None:
        """Return the states that no start leads to, (S,); None where there is none, or that is not known."""
        return None

    @property
    def sizes(self) -> list[int | None]:
        """(states, actions, time limit): by these, files recognise a problem that they do not hold."""
        return [self.n_states, self.n_actions, self.max_episode_steps]

    @abstractmethod
    def save(self) -> tuple[Header, Arrays]:
        """Return what a saved file holds of the problem: data only, no code."""

    @classmethod
    @abstractmethod
    def restore(
        cls, header: Header, arrays: SavedArrays, given: Any, resolve: Callable[..., "Problem"], path: Path
    ) -> "Problem":
        """Return the problem that `save` took apart.

        Parameters
        ----------
        header, arrays
            What `save` returned, or what a stranger wrote: nothing is believed before it is checked.
        given
            The environment that the user gave, or None.
        resolve : callable
            ``resolve(env, **options)`` makes a problem of an environment; `options` replace those of the learner's
            :class:`~tuckerl.adapters.resolve.AdapterOptions`.
        path : Path
            The file, for messages.

        Raises
        ------
        SavedFileError
            If an environment is needed and none is given, or header or arrays are no such problem's.
        ParameterError
            If the one given differs from the one that was saved, or none is needed.
        """

    @classmethod
    def _check_same(cls, problem: "Problem", header: Header, sizes: list[int | None], path: Path, what: str) -> None:
        """Compare a problem with the saved one, by its sizes where the file is too old to hold a description."""
        # Older files know problems without a time limit, and overlooked one below other wrappers.
        limit = problem.max_episode_steps if sizes[2] in (None, STEP_CAP) else sizes[2]
        difference = None
        if "description" in header:
            difference = first_difference(header["description"], problem.description())
        elif problem.kind != cls.kind or problem.sizes != [*sizes[:2], limit]:
            difference = f"it was {what} with (states, actions, time limit) {sizes}; got {problem}"
        if difference:
            raise not_the_saved(path, difference)

    def __repr__(self) -> str:
        sizes = f"{self.n_states} states, {self.n_actions} actions, max_episode_steps={self.max_episode_steps}"
        return f"{type(self).__name__}({self.source}, {sizes})"


def not_the_saved(path: Path, difference: str) -> ParameterError:
    """Return the error of an environment that differs from the one that a learner was saved with."""
    return ParameterError(
        f"env must be the one that {path} was saved with: {difference}. On another one, evaluate(env=...) judges what "
        "was learned, and initial_q= of a new learner begins with its table"
    )


def _counted(number: int, noun: str) -> str:
    return f"{number:,} {noun}{'' if number == 1 else 's'}"
