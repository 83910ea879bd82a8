"""The paper's idea: every few episodes, factorise the agents' Q-tables and let the factors steer learning.

The tables of the last `every` episodes of all agents form a (state, action, episode, agent) tensor. Its Tucker
decomposition gives an action factor A_p, whose row norms scale the learning rate of each action, and an agent factor
Ag_p, whose row norms say whose table all agents go on with (Figures 5, 7 and 8).
"""

import math
import time
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from tuckerl.checks import check_function, check_int, check_name, check_real, check_sequence
from tuckerl.errors import (
    DecompositionError,
    DecompositionWarning,
    RankWarning,
    SavedFileError,
    ZeroWeightWarning,
    warn,
)
from tuckerl.generalization.change_log import ChangeLog
from tuckerl.generalization.loadings import Loadings, loadings_of, read_loadings
from tuckerl.generalization.one_thread import ONE_THREAD
from tuckerl.generalization.sharing import (
    SHARING_RULES,
    ShareContext,
    ShareFunction,
    SharingRule,
    custom_sharing,
    is_copy,
)
from tuckerl.generalization.snapshots import Snapshots
from tuckerl.generalization.step_history import TensorStepHistory, empty_history
from tuckerl.generalization.weights import WEIGHTINGS, WeightFunction, Weighting, custom_weighting, row_norms
from tuckerl.rng import child
from tuckerl.saved_arrays import ANY_LENGTH, SavedArrays, grouped
from tuckerl.tensor import TuckerDecomposition, decompose
from tuckerl.types import FloatArray, IntArray, Ranks

_STREAM = 2**32 - 1  # the child of the learner's seed that is the step's; agents have 0, 1, 2, ...
_NO_RANKS: tuple[int, ...] = (0, 0, 0, 0)
_FAILED: tuple[int, ...] = (-1, -1, -1, -1)  # ranks of a window whose tables could not be decomposed
_NOT_DECOMPOSED = (
    "the tables of a window could not be decomposed ({}): weights and tables stay as they are until the next window "
    "ends; tensor_step_history.failed tells which windows these are"
)
_HUGE, _UNIT = 2.0**900, 2.0**-600  # sums of many numbers as large as the first leave the range of floats


@dataclass(frozen=True)
class TensorStep:
    """When and how to factorise the tables, and what to do with the factors.

    Parameters
    ----------
    every : int
        Episodes in a window; the step follows each window.
    ranks : four ints
        Columns of the state, action, episode and agent factors; clipped to what a window allows.
    weights : str or callable
        ``"paper"``: row norms of A_p over its norm; ``"relative"``: those over their largest; ``"constant"``:
        1/sqrt(A) for every action; ``"permuted"``: the paper's, dealt to random actions; ``"none"``: 1; or a function
        from a :class:`~tuckerl.TuckerDecomposition` to (A,) numbers.
    share : str or callable
        ``"max"`` or ``"min"``: all agents copy the one of largest or smallest row norm of Ag_p; ``"best"``: of the
        highest mean return in the window; ``"random"``; ``"mean"``: the mean of the tables; ``"consensus"``: their
        mean weighted by those norms; ``"none"``; or a function from a ``ShareContext`` to an agent's index, mixture
        weights or None.
    floor : float
        Weights below it are raised to it. 0, the paper's rule, lets an action without values stop learning.
    tol, max_iterations : float, int
        When the decomposition stops; 0 iterations is the truncated HOSVD.

    Raises
    ------
    ParameterError, ParameterTypeError, UnknownNameError
        If a parameter is out of its range, of the wrong type or not a known name.

    References
    ----------
    The paper's Figures 5, 7 and 8.
    """

    every: int
    ranks: Ranks
    weights: str | WeightFunction = "paper"
    share: str | ShareFunction = "max"
    floor: float = 0.0
    tol: float = 1e-4
    max_iterations: int = 50

    def __post_init__(self) -> None:
        object.__setattr__(self, "every", check_int("every", self.every, 1))
        object.__setattr__(self, "ranks", _check_ranks(self.ranks))
        for name, value, known in (("weights", self.weights, WEIGHTINGS), ("share", self.share, SHARING_RULES)):
            if callable(value):
                check_function(name, value, "decomposition" if name == "weights" else "context")
            else:
                check_name(name, value, known)
        object.__setattr__(self, "floor", check_real("floor", self.floor, 0.0, 1.0))
        object.__setattr__(self, "tol", check_real("tol", self.tol, 0.0))
        object.__setattr__(self, "max_iterations", check_int("max_iterations", self.max_iterations, 0))

    @property
    def weighting(self) -> Weighting:
        """The strategy that `weights` names."""
        return WEIGHTINGS[self.weights] if isinstance(self.weights, str) else custom_weighting(self.weights)

    @property
    def sharing(self) -> SharingRule:
        """The rule that `share` names."""
        return SHARING_RULES[self.share] if isinstance(self.share, str) else custom_sharing(self.share)

    @property
    def needs_decomposition(self) -> bool:
        """Whether anything reads the factors: the constant control without sharing, for one, does not."""
        return self.weighting.needs_decomposition or self.sharing.needs_decomposition


class TensorStepResult(NamedTuple):
    """What a learner has to do after a window."""

    weights: FloatArray  # (A,)
    mixture: FloatArray | None  # (N,) of the tables that all agents go on with, or None to leave them
    finite: bool  # False where a table is not finite any more


class HeldStep(NamedTuple):
    """What a file holds of a learner's use of a tensor step."""

    snapshots: dict[str, np.ndarray]
    history: TensorStepHistory
    loadings: Loadings | None


class TensorStepState:
    """One learner's use of a :class:`TensorStep`: the tables of its window, its warnings and its history."""

    def __init__(
        self, step: TensorStep, initial_q: FloatArray, n_agents: int, sequence: np.random.SeedSequence
    ) -> None:
        self.step, self._weighting, self._sharing = step, step.weighting, step.sharing
        self.snapshots = Snapshots(initial_q, n_agents, step.every)
        self._n_actions, self._n_agents = initial_q.shape[1], n_agents
        self._sequence = sequence
        self._warned: set[type[Warning]] = set()
        self._history: list[tuple[int, FloatArray, int, float, tuple[int, ...]]] = []
        self._loadings: Loadings | Callable[[], Loadings] | None = None
        self.seconds = 0.0
        """Processor time of this thread in `close_window` so far."""

    def close_window(
        self, episode: int, weights: FloatArray, logs: tuple[ChangeLog, ...], returns: FloatArray
    ) -> TensorStepResult:
        """Decide what follows the window that ends after `episode` episodes.

        Parameters
        ----------
        weights : (A,) float64
            Those in force during the window.
        logs : N change logs
        returns : (E, N) float64
            The window's undiscounted returns.
        """
        begun = time.thread_time()
        with ONE_THREAD if self.step.needs_decomposition else nullcontext():
            result = self._result(episode, weights, logs, returns)
        self.seconds += time.thread_time() - begun
        return result

    def _result(
        self, episode: int, weights: FloatArray, logs: tuple[ChangeLog, ...], returns: FloatArray
    ) -> TensorStepResult:
        weigh, sharing, decomposition = self._weighting, self._sharing, None
        rng: Any = None  # for rules that draw nothing
        if weigh.draws or sharing.draws:
            rng = np.random.default_rng(child(self._sequence, _STREAM, episode // self.step.every))
        if self.step.needs_decomposition:
            tensor, largest = self._tables(logs)
            if not math.isfinite(largest):
                return TensorStepResult(weights, None, finite=False)
            ranks = _NO_RANKS
            try:
                decomposition = self._decompose(tensor) if largest > 0.0 else None  # nothing was learned yet
            except DecompositionError as error:
                ranks = _FAILED
                self._warn(DecompositionWarning, _NOT_DECOMPOSED.format(error))
            if decomposition is None:  # everything stays as it is, but for weights that do not ask
                if not weigh.needs_decomposition:
                    weights = np.maximum(weigh.weigh(None, self._n_actions, rng), self.step.floor)
                self._remember(episode, weights, None, fit=np.nan, ranks=ranks)
                return TensorStepResult(weights, None, finite=True)
            self._loadings = partial(loadings_of, decomposition, self.snapshots.changed, episode)
            if decomposition.ranks != self.step.ranks:
                self._warn(
                    RankWarning,
                    f"ranks {self.step.ranks} are more than the tables of a window allow and were clipped to "
                    f"{decomposition.ranks}; later windows may be clipped otherwise (see tensor_step_history.ranks)",
                )
        weights = np.maximum(weigh.weigh(decomposition, self._n_actions, rng), self.step.floor)
        if not weights.all():
            self._warn(
                ZeroWeightWarning,
                f"the weight of action {int(np.argmin(weights))} is 0, so it does not learn in the next window (the "
                "paper's weight is 0 where an action's column was zero in every table); a floor above 0 keeps it alive",
            )
        norms = np.ones(self._n_agents) if decomposition is None else row_norms(decomposition.factors[3])
        mixture = sharing.mix(ShareContext(norms, returns, rng))
        fit, ranks = (np.nan, _NO_RANKS) if decomposition is None else (decomposition.fit, decomposition.ranks)
        self._remember(episode, weights, mixture, fit=fit, ranks=ranks)
        return TensorStepResult(weights, mixture, finite=True)

    def _tables(self, logs: tuple[ChangeLog, ...]) -> tuple[FloatArray, float]:
        """Return the window's tables and their largest magnitude; where that is huge, in units of its power of two."""
        with np.errstate(over="ignore", invalid="ignore"):
            tensor = self.snapshots.tensor(logs)
            largest = max(tensor.max(initial=0.0), -tensor.min(initial=0.0))
            if largest < _HUGE:
                return tensor, float(largest)
            tensor = self.snapshots.tensor(logs, _UNIT)
        return tensor, float(np.abs(tensor).max())

    def _decompose(self, tensor: FloatArray) -> TuckerDecomposition:
        return decompose(tensor, tuple(self.step.ranks), self.step.tol, self.step.max_iterations)

    @property
    def loadings(self) -> Loadings | None:
        """The factors of the latest window that was decomposed, made when somebody reads them."""
        held = self._loadings
        if not callable(held):
            return held
        with ONE_THREAD:
            made = held()
        if self._loadings is held:  # else another thread has closed a window meanwhile
            self._loadings = made
        return made

    @property
    def n_windows(self) -> int:
        """Number of windows that were closed."""
        return len(self._history)

    @property
    def history(self) -> TensorStepHistory:
        """What was done after each window so far."""
        if not self._history:
            return empty_history(self._n_actions)
        return TensorStepHistory(*(np.array(column) for column in zip(*self._history, strict=True)))

    def saved(self) -> dict[str, np.ndarray]:
        """Return the arrays from which `restore` goes on."""
        arrays = {**self.snapshots.saved(), **self.history._asdict()}
        return arrays if self.loadings is None else arrays | grouped("loadings", self.loadings.to_arrays())

    def read(self, arrays: SavedArrays, finished: IntArray, *, diverged: bool) -> "HeldStep":
        """Return what a file holds of a learner's use of this step.

        Parameters
        ----------
        arrays : SavedArrays
            As `saved` returned them.
        finished : (N,) int64
            The episodes that each agent has finished.
        diverged : bool
            Whether a table was not finite any more.

        Raises
        ------
        SavedFileError
            If it is none of such a learner's.
        """
        every, n_agents, n_actions = self.step.every, self._n_agents, self._n_actions
        episode = arrays.take("episode", np.int64, (ANY_LENGTH,))
        n, episodes = episode.size, int(finished.min())
        is_due = n == episodes // every - 1 and (episodes % every == 0 or diverged)
        if not (n == episodes // every or is_due) or finished.max() > (n + 1) * every:
            raise SavedFileError(f"its windows of {every} episodes are not those of the episodes that it has")
        if not np.array_equal(episode, every * np.arange(1, n + 1)):
            raise SavedFileError(f"its windows must end every {every} episodes")
        fit = arrays.take("fit", np.float64, (n,))
        history = TensorStepHistory(
            episode,
            arrays.take("weights", np.float64, (n, n_actions), 0.0, finite=True),
            arrays.take("chosen", np.int64, (n,), -1, n_agents - 1),
            fit,
            arrays.take("ranks", np.int64, (n, 4), -1),
        )
        sizes = (self.snapshots.n_states, n_actions, every, n_agents)
        loadings = read_loadings(arrays.group("loadings"), sizes, self.step.ranks, episodes)
        return HeldStep(self.snapshots.read(arrays, finite=not diverged), history, loadings)

    def restore(self, held: "HeldStep") -> None:
        """Go on from what `read` returned."""
        self.snapshots.restore(held.snapshots)
        self._loadings = held.loadings
        self._history = [
            (int(episode), weights, int(chosen), float(fit), tuple(int(rank) for rank in ranks))
            for episode, weights, chosen, fit, ranks in zip(*held.history, strict=True)
        ]

    def _warn(self, category: type[Warning], message: str) -> None:
        if category not in self._warned:
            self._warned.add(category)
            warn(message, category)

    def _remember(
        self, episode: int, weights: FloatArray, mixture: FloatArray | None, *, fit: float, ranks: tuple[int, ...]
    ) -> None:
        chosen = int(np.argmax(mixture)) if mixture is not None and is_copy(mixture) else -1
        self._history.append((episode, weights.copy(), chosen, fit, ranks))


def _check_ranks(ranks: object) -> tuple[int, ...]:
    expected = "four whole numbers of at least 1, for the state, action, episode and agent axes"
    asked = check_sequence("ranks", ranks, expected, 4)
    return tuple(check_int(f"the {axis} rank", rank, 1) for axis, rank in zip(_AXES, asked, strict=True))


_AXES = ("state", "action", "episode", "agent")
