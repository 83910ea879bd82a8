"""What all environments that Python steps have in common: copies for several agents, errors, time, and seeds."""

import contextlib
import copy
import math
import operator
import time
from collections.abc import Callable, Sequence
from functools import cached_property
from itertools import chain
from typing import Any

import numpy as np

from tuckerl._jit import kernel
from tuckerl.adapters.alike import class_that_says_how, lost_by_copying
from tuckerl.adapters.generators import OwnGenerators, own_generators
from tuckerl.adapters.making import close
from tuckerl.adapters.masks import MASK_IS_LATE
from tuckerl.adapters.seeding import EpisodeSeeds
from tuckerl.adapters.step_results import check_step, reset_result
from tuckerl.errors import EnvironmentFaultError, ObservationError, ProblemError
from tuckerl.problems.dynamics import WorldArrays
from tuckerl.problems.worlds import World
from tuckerl.rng import child, generator_as_json
from tuckerl.types import BoolArray

FAULT, YIELD, REWARD_IS_NOT_FINITE = -1, -2, -3
"""Why a kernel must return: an error was raised, it is time, a reward cannot be learned from."""

_OWN = 2**32 - 1  # the child of an environment's seed for the generators of its own


@kernel
def must_return(world: WorldArrays) -> bool:
    """Return whether the callback has asked the kernel to return.

    Parameters
    ----------
    world : NamedTuple
        With ``status``, (1,) int64: 0, or one of `FAULT`, `YIELD` and `REWARD_IS_NOT_FINITE`.
    """
    return world.status[0] < 0


class EnvironmentCopies:
    """The environments of one problem: the one that was given, then others like it.

    Parameters
    ----------
    first
        The one that was given.
    source : str
        What it is called in messages.
    make : callable, optional
        Makes one more; by default the first one is copied.
    """

    def __init__(self, first: Any, source: str, make: Callable[[], Any] | None) -> None:
        self.first, self.source, self._make = first, source, make
        self._spare = [first]
        self._lost: str | None = None  # what a copy has otherwise
        self._states: dict[str, Any] = {}  # of the own generators after the first reset

    def of_copies(self, environments: Sequence[Any], memo: dict[int, Any]) -> "EnvironmentCopies":
        """Return the environments of a copied problem: first copies of these, in the state that they are in.

        Raises
        ------
        ProblemError
            If one cannot be copied, or its class says itself how it is copied: it may be made anew, and what was drawn
            would be lost.
        """
        try:
            copied = [copy.deepcopy(env, memo) for env in environments]
        except Exception as error:  # whatever a copy raises
            raise ProblemError(
                f"{self.source} cannot be copied ({type(error).__name__}: {error}): use the learner's save(), and "
                "load() with another environment as env="
            ) from error
        remade = next(filter(None, map(class_that_says_how, environments)), None)
        if remade is not None:
            raise ProblemError(
                f"{self.source} cannot be copied as it is, as {remade} says itself how it is copied: use the learner's "
                "save(), and load() with another environment as env="
            )
        copies = EnvironmentCopies(copied[0], self.source, self._make)
        copies._spare, copies._states = copied[::-1], self._states
        return copies

    def take(self) -> Any:
        """Return an environment that nobody else has: the first one to the first caller.

        Raises
        ------
        ProblemError
            If one more is needed and it cannot be copied.
        """
        return self._spare.pop() if self._spare else self.another()

    def another(self) -> Any:
        """Return a new environment like the first.

        Raises
        ------
        ProblemError
            If it cannot be copied.
        """
        if self._make is not None:
            return self._make()
        self._refuse_remade()
        try:
            return copy.deepcopy(self.first)
        except Exception as error:  # whatever a copy raises
            raise ProblemError(
                f"{self.source} cannot be copied for one more agent ({type(error).__name__}: {error}): pass its id, or "
                "a callable that makes one"
            ) from error

    def _refuse_remade(self) -> None:
        """Refuse to copy an environment whose copies are others."""
        if self._lost is not None:
            raise ProblemError(
                f"a copy of {self.source} is not like it (in {self._lost}), as its class says itself how it is copied: "
                "pass its id, or a callable that makes one with all that was changed on it"
            )

    def close(self, env: Any) -> None:
        """Close one of these, unless it is the user's own."""
        if self._make is not None or env is not self.first:
            close(env, self.source)

    def try_out(self, look: Callable[[Any, Any], bool]) -> bool:
        """Begin an episode, to find mistakes before learning begins; return what `look` says of what reset returned.

        Raises
        ------
        ObservationError
            If the first observation does not lie in its space.
        ProblemError
            If reset raises anything else.
        """
        try:
            seen = look(*reset_result(self.first.reset(seed=0)))
        except (ObservationError, ProblemError):
            raise
        except Exception as error:  # whatever an environment raises
            raise ProblemError(f"{self.source} does not begin: reset raised {type(error).__name__}: {error}") from error
        if self._make is None:
            self._lost = lost_by_copying(self.first)
        else:
            self._states = _states_of_generators(self.first)
        return seen

    @cached_property
    def decided_generators(self) -> frozenset[str]:
        """Where generators stand whose state is the same in two environments made and reset alike: an author's choice.

        Of an environment that was given as an instance there are none: all copies of it have the same.
        """
        if not self._states or self._make is None:
            return frozenset()
        try:
            other = self._make()
            other.reset(seed=0)
        except Exception:  # noqa: BLE001  # there can be one only, perhaps
            return frozenset()
        states = _states_of_generators(other)
        with contextlib.suppress(Exception):  # it was made to be looked at only
            other.close()
        return frozenset(place for place, state in self._states.items() if states.get(place) == state)


def _states_of_generators(env: Any) -> dict[str, Any]:
    return {place: generator_as_json(own) for place, own in own_generators(env).generators.items()}


class PythonWorld(World):
    """One environment that kernels step through a callback.

    Parameters
    ----------
    problem : PythonProblem
    env
        A copy that nobody else has.
    """

    def __init__(self, problem: Any, env: Any) -> None:
        self.problem, self.source, self.env = problem, problem.source, env
        self.seeds = EpisodeSeeds(env)
        self.generators = OwnGenerators(env, self.source, lambda: problem.copies.decided_generators)
        shape = (problem.n_states, problem.n_actions) if problem.has_masks else (0, 0)
        self.action_masks = tuple(np.ones(shape, dtype=np.bool_) for _ in problem.spaces)
        pairs = zip(self.action_masks, problem.spaces, strict=True)
        self._own_masks = [table[:, : own.actions.n] for table, own in pairs]
        for table, own in zip(self.action_masks, self._own_masks, strict=True):
            table[:, own.shape[1] :] = False
        self._masks_before: dict[tuple[int, int], BoolArray] = {}  # the rows that changed since `keep`
        self._declared: list[tuple[Any, Any]] = [(None, None) for _ in problem.spaces]  # those found equal latest
        self._error: BaseException | None = None
        self._deadline = math.inf

    def fail(self, error: BaseException, result: Any = None) -> int:
        """Keep an error for `raise_pending`; return the callback's answer that makes the kernel return.

        Where `result`, which a step returned, is none that steps return, that is the error.
        """
        if isinstance(error, (TypeError, ValueError)) and result is not None:
            try:
                check_step(result)
            except ProblemError as better:
                error = better
        self._error = error
        return FAULT

    @property
    def is_late(self) -> bool:
        """Whether the deadline has passed, so that no further episode should begin."""
        return time.monotonic() > self._deadline

    def note_mask(self, table: int, state: int, mask: BoolArray | None) -> None:
        """Keep where actions may be taken in a state of an agent's own, None being everywhere.

        Raises
        ------
        ProblemError
            If the first reset gave no mask.
        """
        if self.problem.has_masks:
            row = self._own_masks[table][state]
            if (table, state) not in self._masks_before:
                self._masks_before[table, state] = row.copy()
            row[:] = True if mask is None else mask
        elif mask is not None:
            raise ProblemError(MASK_IS_LATE)

    @property
    def n_own_actions(self) -> tuple[int, ...]:
        """How many of the actions each table's agent has; no mask allows those beyond."""
        return tuple(own.shape[1] for own in self._own_masks)

    def seed(self, sequence: np.random.SeedSequence) -> None:
        """Seed the environment's resets from `sequence`."""
        self.seeds.sequence = child(sequence, 0)

    def set_deadline(self, seconds: float) -> None:
        """Make the next kernel return at the first end of an episode after so many seconds."""
        self._deadline = time.monotonic() + seconds
        self.generators.look_away()

    def keep(self) -> None:
        """Remember the environment's seeds and generators, and the masks that were seen."""
        self.seeds.keep()
        self.generators.keep()
        self._masks_before.clear()

    def undo(self) -> None:
        """Go back to where `keep` was called; what else an environment remembers of an episode stays."""
        self.seeds.undo()
        self.generators.undo()
        for (table, state), mask in self._masks_before.items():
            self._own_masks[table][state] = mask

    def raise_pending(self) -> None:
        """Raise the error that made the latest kernel return, if any, and forget it.

        Raises
        ------
        EnvironmentFaultError
            If the environment raised an error, or paid a reward that is not finite; it names step, episode and seed.
        """
        status, self.arrays.status[0] = self.arrays.status[0], 0
        error, self._error = self._error, None
        if status not in (FAULT, REWARD_IS_NOT_FINITE):
            return
        if error is not None and not isinstance(error, Exception):  # KeyboardInterrupt, SystemExit and their like
            raise error
        what = f"failed ({type(error).__name__}: {error})"
        if error is None:  # raised before the callback's first line, by a signal's handler say; Python has printed it
            what = "was broken off by an error that is printed above"
        if status == REWARD_IS_NOT_FINITE:
            what = f"paid a reward that is not finite ({', '.join(map(str, self.arrays.reward))})"
        raise EnvironmentFaultError(
            f"{self.source} {what} {self.seeds.where(int(self.arrays.clock[0]))}; what was learned before is kept, and "
            "learn() plays this episode again"
        ) from error

    def close(self) -> None:
        """Close the environment, unless it is the user's own."""
        self.problem.copies.close(self.env)

    def begin(self) -> tuple[Any, Any]:
        """Begin an episode; return what the environment's reset returns.

        Raises
        ------
        ProblemError
            If the environment's spaces are others than those that it had.
        """
        self.generators.watch()
        seen = reset_result(self.seeds.reset() if self.seeds.n_resets > 1 else self._early_reset())
        self.generators.watch()
        declared = self.problem.declared(self.env)
        if all(map(operator.is_, chain(*declared), chain(*self._declared))):  # objects that were equal are so still
            return seen
        difference = self.problem.difference_of_declared(declared)
        if difference is not None:
            raise ProblemError(
                f"its spaces must stay as they are, as tables have as many rows and columns: {difference}; declare the "
                "largest, and mask actions"
            )
        self._declared = declared
        return seen

    def _early_reset(self) -> tuple[Any, Any]:
        """Begin the first or second episode; begin it again where it made generators that no seed of ours decided."""
        is_first, own = self.seeds.n_resets == 0, child(self.seeds.sequence, _OWN)
        if is_first:
            self.generators.seed(own)
        else:
            self.generators.look()
        seen = self.seeds.reset()
        if not self.generators.look():
            return seen
        if is_first:
            self.generators.seed(own)
        elif self.seeds.gives_each_a_seed:
            return seen
        else:  # every reset makes them anew, from the seed that it is given
            self.seeds.always = True
        return self.seeds.reset_again()

    def saved(self) -> dict[str, Any]:
        """Return the environment's seeds and generators."""
        return self.seeds.saved() | {"own generators": self.generators.saved()}

    def follow(self, original: World) -> None:
        """Go on as a world does of whose environment this one has a copy, which needs no reset."""
        if isinstance(original, PythonWorld):
            self.seeds.follow(original.seeds)
            self.generators.follow(original.generators)

    def restore(self, header: dict[str, Any]) -> None:
        """Go on from what `saved` returned."""
        self.seeds.restore({name: part for name, part in header.items() if name != "own generators"})
        if header["resets"]:
            self.generators.restore(header.get("own generators", {}))
