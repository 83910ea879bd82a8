"""What all problems that Python steps have in common: numbers for observations and actions, time limits, files."""

import copy
import sys
from abc import abstractmethod
from collections.abc import Callable, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple, NotRequired, Self, TypedDict

import gymnasium
import numpy as np
from gymnasium.vector.utils import concatenate, create_empty_array

from tuckerl.adapters.action_names import action_names_of
from tuckerl.adapters.held import bytes_of_arrays
from tuckerl.adapters.masks import MaskReader
from tuckerl.adapters.python_world import EnvironmentCopies
from tuckerl.errors import ParameterError, SavedFileError, UnknownNameError
from tuckerl.problems.parts import STEP_CAP, StateFactor
from tuckerl.problems.problem import GIVE_ENV, Arrays, Choose, Header, Problem
from tuckerl.saved_arrays import SavedArrays
from tuckerl.saved_json import checked_json
from tuckerl.spaces.bins import MOST_BINS
from tuckerl.spaces.description import Description, describe_numbers, describe_space, difference_of_spaces, digest
from tuckerl.spaces.encoder import SpaceEncoder, check_countable, digit_names, space_encoder, space_encoder_of_edges
from tuckerl.types import BoolArray, FloatArray

_FEW_EDGES = 16  # dimensions whose edges a file describes one by one


class _StoredProblem(TypedDict):
    """What a file holds of an environment beside the edges of its bins."""

    id: str | None
    source: str
    sizes: tuple[int, int, int | None]
    agents: list[str]
    description: NotRequired[dict[str, Any]]  # older files have none


class Edges(NamedTuple):
    """The inner edges of all bins, as a saved file holds them: given as `bins`, they make the same encoders again."""

    by_agent: dict[int, tuple[FloatArray, ...]]  # by the place of the agent, 0 if there is one; none without a Box


class AgentSpaces:
    """What one agent, or all together, observe and do, as numbers.

    Parameters
    ----------
    observation_space, action_space : gymnasium.Space
    bins
        How a Box is cut into bins, see :func:`tuckerl.spaces.encoder.space_encoder`; or the saved `Edges`.
    agent : optional
        Whose they are, for messages.
    place : int
        The agent's place among all.

    Attributes
    ----------
    read : MaskReader
        What separates an observation from the action mask that may lie in it.
    observations, actions : SpaceEncoder

    Raises
    ------
    SpaceError
        If a space cannot be numbered.
    """

    def __init__(
        self,
        observation_space: gymnasium.Space[Any],
        action_space: gymnasium.Space[Any],
        bins: Any,
        agent: Any = None,
        place: int = 0,
    ) -> None:
        of = "" if agent is None else f" of {agent}"
        self._observation_space = observation_space
        self.read = MaskReader(observation_space, action_space)
        check_countable(action_space, what=f"action{of}")
        # Actions first: where they are continuous, advice about bins would not help.
        self.actions: SpaceEncoder = space_encoder(action_space, what=f"action{of}")
        space, what = self.read.observation_space, f"observation{of}"
        if isinstance(bins, Edges):
            self.observations: SpaceEncoder = space_encoder_of_edges(space, bins.by_agent.get(place, ()), what=what)
        else:
            check_countable(space, bins, what=what)
            self.observations = space_encoder(space, bins, what=what)

    def difference(self, observation_space: Any, action_space: Any) -> str | None:
        """Return the first thing in which other spaces differ from these; None where none does."""
        was = (self._observation_space, self.actions.space)
        pairs = zip(was, (observation_space, action_space), ("observation", "action"), strict=True)
        return next((found for pair in pairs if (found := difference_of_spaces(*pair))), None)

    def description(self) -> Description:
        """Return the spaces as the environment declares them, and the edges of the bins, as JSON."""
        edges = self.observations.edges
        return {
            "observation": describe_space(self._observation_space),
            "action": describe_space(self.actions.space),
            "bins": [describe_numbers(own) for own in edges] if len(edges) <= _FEW_EDGES else digest(*edges),
        }

    def encode(self, observation: Any, info: Any) -> tuple[int, BoolArray | None]:
        """Return the number of what an environment returned, and the action mask that came with it."""
        part, mask = self.read(observation, info)
        return self.observations.encode(part), mask

    def decide(self, observation: Any, table: int, choose: Choose, *action_masks: Any) -> Any:
        """Return the actions chosen by a table, see :meth:`tuckerl.problems.problem.Problem.decide`; all masks hold."""
        observation, carried = self.read.take_apart(observation)
        is_batch = self.observations.is_batch(observation)
        encode = self.observations.encode_many if is_batch else self.observations.encode
        states = np.array(encode(observation))
        read = [self.read.allowed(given, states.shape) for given in (carried, *action_masks)]
        masks = [mask for mask in read if mask is not None]
        chosen = choose(table, states, np.logical_and.reduce(masks) if masks else None)
        if not is_batch:
            return self.actions.decode(int(chosen[()]))
        actions = [self.actions.decode(int(action)) for action in chosen]
        batch: Any = create_empty_array(self.actions.space, len(actions))
        return concatenate(self.actions.space, actions, batch) if actions else batch


class PythonProblem(Problem):
    """An environment that Python steps, with numbers for its observations and actions.

    Parameters
    ----------
    env
        The first world plays this one.
    source : str
        What it is called in messages.
    make : callable, optional
        Makes one more; by default it is copied.
    spaces : sequence of AgentSpaces
        Of each agent with a table of its own; the largest of them size the tables.
    action_sizes, **parts
        See :class:`~tuckerl.problems.problem.Problem`.
    max_episode_steps : int, optional
        An episode is truncated after as many steps. Default: when the environment says so, and after `STEP_CAP`.
    tries_out : bool
        Whether the environment is reset once, to find mistakes; otherwise it counts as one that gives masks.

    Attributes
    ----------
    has_masks : bool
        Whether the environment gives action masks: the first reset decides.

    Raises
    ------
    ProblemError
        If the environment does not begin.
    """

    source: str
    title = "environment"
    how_played = "stepped in Python"
    is_compiled = False

    def __init__(
        self,
        env: Any,
        source: str,
        make: Callable[[], Any] | None,
        spaces: Sequence[AgentSpaces],
        *,
        max_episode_steps: int | None = None,
        action_sizes: tuple[int, ...] | None = None,
        tries_out: bool = True,
        **parts: Any,
    ) -> None:
        n_actions = max(own.actions.n for own in spaces)
        super().__init__(
            max(own.observations.n for own in spaces),
            n_actions,
            max_episode_steps=max_episode_steps or STEP_CAP,
            is_capped=max_episode_steps is None,
            source=source,
            action_sizes=action_sizes,
            action_names=action_names_of(env, action_sizes or (n_actions,)),
            **parts,
        )
        self.spaces = tuple(spaces)
        self.copies = EnvironmentCopies(env, source, make)
        self.has_masks = self.copies.try_out(self._look) if tries_out else True

    @property
    def env(self) -> Any:
        """The environment that the first agent steps, without the wrappers that are taken over (time limits)."""
        return self.copies.first

    def made_for_us(self) -> Self:
        """Return the same problem, whose world closes its environment, as it is not the user's."""
        return self._replace(copies=EnvironmentCopies(self.env, self.source, lambda: copy.deepcopy(self.env)))

    @property
    def edges(self) -> Edges | None:
        """The edges of all bins, None where no observation is a Box."""
        by_agent = {place: own.observations.edges for place, own in enumerate(self.spaces) if own.observations.edges}
        return Edges(by_agent) if by_agent else None

    def _look(self, observation: Any, info: Any) -> bool:
        """Try to number the first observation; return whether there is a mask."""
        return self.spaces[0].encode(observation, info)[1] is not None

    def for_copy(self, worlds: Sequence[Any], memo: dict[int, Any]) -> Problem:
        """Return the same problem with copies of the environments, as these worlds have left them.

        Raises
        ------
        ProblemError
            If one cannot be copied.
        """
        environments = [world.env for world in worlds]
        return self._replace(copies=self.copies.of_copies(environments, memo))

    @property
    def state_factors(self) -> tuple[StateFactor, ...]:
        """The digits of an observation's number; where agents with tables of their own differ, there is one."""
        encoder = self.spaces[0].observations
        if len(encoder.sizes) == 1 or not self.has_equal_spaces:
            return super().state_factors
        return tuple(map(StateFactor, digit_names(encoder), encoder.sizes))

    @property
    def world_bytes(self) -> int:
        """Bytes of the action masks that a world keeps."""
        return len(self.spaces) * self.n_states * self.n_actions if self.has_masks else 0

    @cached_property  # every evaluation asks, and the answer goes through all that an environment holds
    def copy_bytes(self) -> int:
        """Bytes of the arrays that an environment holds."""
        return bytes_of_arrays(self.env)

    def save(self) -> tuple[Header, Arrays]:
        """Return the environment's id, sizes and agents, and the edges of its bins."""
        agents = [str(agent) for agent in self.agents]
        arrays = {
            f"edges/{place}/{i:06}": edges
            for place, own in enumerate(self.spaces)
            for i, edges in enumerate(own.observations.edges)
        }
        header = {"id": self.id, "source": self.source, "sizes": self.sizes, "agents": agents}
        return header | {"description": self.description()}, arrays

    def difference_of_declared(self, declared: Sequence[tuple[Any, Any]]) -> str | None:
        """Return the first thing in which spaces that an environment declares differ from ours; None if none does."""
        differences = (own.difference(*now) for own, now in zip(self.spaces, declared, strict=True))
        return next((difference for difference in differences if difference), None)

    @abstractmethod
    def declared(self, env: Any) -> list[tuple[Any, Any]]:
        """Return the observation and action space that an environment declares for each of `spaces`."""

    def spaces_description(self) -> Description:
        """Return the spaces and bins, of each agent with a table of its own, as JSON."""
        of_agents = [own.description() for own in self.spaces]
        agents = [str(agent) for agent in self.agents]
        if not self.shares_world:
            return of_agents[0] | ({"agents": agents} if agents else {})
        return {"agents": agents, "spaces of": dict(zip(agents, of_agents, strict=True))}

    def description(self) -> Description:
        """Return all that makes this environment the one that it is, but for its code, as JSON."""
        return super().description() | {"action masks": self.has_masks}

    @classmethod
    def restore(
        cls, header: Header, arrays: SavedArrays, given: Any, resolve: Callable[..., Problem], path: Path
    ) -> Problem:
        """Return the problem of the environment that the user gave, or that its id makes, with the saved bins."""
        checked_json(header, _StoredProblem, f"the environment in {path}")
        if given is None and header["id"] is not None:
            _check_imported(header["id"], path)
        if given is None and header["id"] is None:
            raise SavedFileError(
                f"{path} was learned on an environment that no file holds, {header['source']}: {GIVE_ENV}"
            )
        expected = f"env must be the one that {path} was saved with"
        try:
            problem = resolve(header["id"] if given is None else given, bins=_restored_edges(arrays), compiled=False)
        except (ParameterError, UnknownNameError) as error:  # of edges or a reward that belong to another environment
            raise type(error)(f"{expected}, {header['source']}: {error}") from error
        cls._check_same(problem, header, header["sizes"], path, "an environment")
        agents = [str(agent) for agent in problem.agents]
        if agents != header["agents"]:
            raise ParameterError(
                f"{expected}, of the agents {', '.join(header['agents'])}, in this order; got {', '.join(agents)}"
            )
        return problem


def _check_imported(env_id: str, path: Path) -> None:
    """Refuse an id that names a module (``"module:Env-v0"``) which Gymnasium would import: a file runs no code.

    Raises
    ------
    SavedFileError
        If it names one that has not been imported.
    """
    module = env_id.rpartition(":")[0]
    if module and module not in sys.modules:
        raise SavedFileError(
            f"{path} was learned on {env_id!r:.80}, of a module that has not been imported: import it if you trust the "
            "file, or pass load() its env"
        )


def _restored_edges(arrays: SavedArrays) -> Edges | None:
    """Return the edges in a saved file's arrays, None where no observation is a Box."""
    edges, by_agent = arrays.group("edges"), {}
    for place in sorted({name.partition("/")[0] for name in edges}):
        own = edges.group(place)
        by_agent[int(place)] = tuple(own.take(name, np.float64, (range(MOST_BINS),)) for name in sorted(own))
    return Edges(by_agent) if by_agent else None
