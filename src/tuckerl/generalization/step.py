"""The paper's idea: every few episodes, factorise the agents' Q-tables and let the factors steer learning.

The tables of the last `every` episodes of all agents form a (state, action, episode, agent) tensor. Its Tucker
decomposition gives an action factor A_p, whose row norms scale the learning rate of each action, and an agent factor
Ag_p, whose row norms say whose table all agents go on with (Figures 5, 7 and 8).
"""

import math
import time
from collections.abc import Callable
from contextlib import nullcontext
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from tuckerl.errors import (
    DecompositionError,
    DecompositionWarning,
    RankWarning,
    SavedFileError,
    ZeroWeightWarning,
    warn,
)
from tuckerl.generalization.change_log import ChangeLog, log_shared
from tuckerl.generalization.loadings import Loadings, loadings_of, read_loadings
from tuckerl.generalization.log_window import LogWindow
from tuckerl.generalization.mixtures import is_copy
from tuckerl.generalization.sharing import ShareContext
from tuckerl.generalization.snapshots import Snapshots
from tuckerl.generalization.step_history import TensorStepHistory, empty_history
from tuckerl.generalization.tensor_step import TensorStep
from tuckerl.generalization.weights import row_norms
from tuckerl.rng import child
from tuckerl.saved_arrays import ANY_LENGTH, SavedArrays, grouped
from tuckerl.tensor import TuckerDecomposition, decompose
from tuckerl.tensor.one_thread import ONE_THREAD
from tuckerl.tensor.ranks import numbers_or_share
from tuckerl.types import FloatArray, IntArray

_STREAM = 2**32 - 1  # the child of the learner's seed that is the step's; agents have 0, 1, 2, ...
_NO_RANKS: tuple[int, ...] = (0, 0, 0, 0)
_FAILED: tuple[int, ...] = (-1, -1, -1, -1)  # ranks of a window whose tables could not be decomposed
_NOT_DECOMPOSED = (
    "the tables of a window could not be decomposed ({}): weights and tables stay as they are until the next window "
    "ends; tensor_step_history.failed tells which windows these are"
)
_HUGE, _UNIT = 2.0**900, 2.0**-600  # sums of many numbers as large as the first leave the range of floats
_USUAL_ENERGY = 1e-200, 1e200  # of tables that are neither zero nor huge, whose sum of squares says so at once


class Shrinkage(NamedTuple):
    """By how much which rows are to be drawn to what a decomposition says of them."""

    part: float  # in (0, 1]
    states: IntArray  # (C,)
    rows: FloatArray  # (N, C, A)


class TensorStepResult(NamedTuple):
    """What a learner has to do after a window."""

    weights: FloatArray  # (A,)
    mixture: FloatArray | None  # (N,) of the tables that all agents go on with, (N, R, A) of entries, None for none
    finite: bool  # False where a table is not finite any more
    states: IntArray | None = None  # (R,) whose rows may differ between agents; None where that is not known
    shrinkage: Shrinkage | None = None  # after that


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
        self.snapshots, self.places = Snapshots(initial_q, n_agents), LogWindow(step, n_agents)
        self._ranks = numbers_or_share(step.ranks or (1, 1, 1, 1))  # without ranks nothing reads them
        self._n_actions, self._n_agents = initial_q.shape[1], n_agents
        self._decomposes, self._shares = step.needs_decomposition, step.share != "none"
        self._sequence = sequence
        self._warned: set[type[Warning]] = set()
        self._history: list[tuple[int, FloatArray, int, float, tuple[int, ...]]] = []
        self._loadings: Loadings | Callable[[], Loadings] | None = None
        self.seconds = 0.0
        """Processor time of this thread in `close_window` so far."""

    def close_window(
        self, weights: FloatArray, logs: tuple[ChangeLog, ...], returns: FloatArray, q: FloatArray
    ) -> TensorStepResult:
        """Decide what follows the window that ends here.

        Parameters
        ----------
        weights : (A,) float64
            Those in force during the window.
        logs : N change logs
        returns : (N, episodes) float64
            The undiscounted returns of all episodes so far.
        q : (N, S, A) float64
            The tables at its end.
        """
        begun = time.thread_time()
        with ONE_THREAD if self._decomposes else nullcontext():
            result = self._result(weights, logs, returns, q)
        self.seconds += time.thread_time() - begun
        return result

    def _result(
        self, weights: FloatArray, logs: tuple[ChangeLog, ...], returns: FloatArray, q: FloatArray
    ) -> TensorStepResult:
        step, decomposition, fit, ranks = self.step, None, np.nan, _NO_RANKS
        episode, unit = returns.shape[1], 1.0
        weighs, shares = episode % step.every == 0, episode % step.share_interval == 0
        rng: Any = None  # for rules that draw nothing
        if self._weighting.draws or self._sharing.draws:
            rng = np.random.default_rng(child(self._sequence, _STREAM, episode // step.interval))
        if weighs and self._decomposes:
            tensor, largest, unit = self._tables(logs, episode)
            if not math.isfinite(largest):
                return TensorStepResult(weights, None, finite=False)
            decomposition, ranks = self._decomposed(tensor, largest, episode)
            if decomposition is None:  # everything stays as it is, but for weights that do not ask
                if not self._weighting.needs_decomposition:
                    weights = self._weights(None, rng)
                self._remember(episode, weights, None, fit=np.nan, ranks=ranks)
                return TensorStepResult(weights, None, finite=True)
            fit = decomposition.fit
        weights = self._weights(decomposition, rng) if weighs else weights
        mixture, states = None, None
        if shares and self._shares:
            mixture, states = self._mixture(decomposition, rng, logs, returns, q)
        self._remember(episode, weights, mixture, fit=fit, ranks=ranks)
        shrinkage = None
        if shares and step.shrink > 0.0 and decomposition is not None:
            rows = _last_episode(decomposition, self.snapshots.changed.size) / unit
            shrinkage = Shrinkage(step.shrink, self.snapshots.changed, rows)
        return TensorStepResult(weights, mixture, finite=True, states=states, shrinkage=shrinkage)

    def begin_window(self, logs: tuple[ChangeLog, ...], q: FloatArray, result: TensorStepResult, episode: int) -> None:
        """Go on from `result` after so many episodes, with the (N, S, A) tables as they are now."""
        if self.places.length == 0:
            return
        if episode % self.step.share_interval == 0:
            stay_apart = result.mixture is None or result.shrinkage is not None
            self.snapshots.may_differ = stay_apart and self._n_agents > 1
        if self.places.is_end(episode):
            are_all = self.step.share_interval == self.places.length and result.shrinkage is None
            self.snapshots.restart(logs, q, result.states if are_all else None)
        elif self.places.is_shared_within(episode):
            states = self.snapshots.states[:0] if result.mixture is None else result.states
            for log, table in zip(logs, q, strict=True):
                log_shared(log, table, self.snapshots.touched(logs) if states is None else states)

    def _weights(self, decomposition: TuckerDecomposition | None, rng: Any) -> FloatArray:
        """Return the actions' weights in the next window, (A,)."""
        weights: FloatArray = self._weighting.weigh(decomposition, self._n_actions, rng)
        weights = np.maximum(weights, self.step.floor)
        if not weights.all():
            self._warn(
                ZeroWeightWarning,
                f"the weight of action {int(np.argmin(weights))} is 0, so it does not learn in the next window (the "
                "paper's weight is 0 where an action's column was zero in every table); a floor above 0 keeps it alive",
            )
        return weights

    def _mixture(
        self,
        decomposition: TuckerDecomposition | None,
        rng: Any,
        logs: tuple[ChangeLog, ...],
        returns: FloatArray,
        q: FloatArray,
    ) -> tuple[FloatArray | None, IntArray | None]:
        """Return what all agents go on with, and the states whose rows that changes; None where that is not known."""
        norms, episode, n_episodes = None, returns.shape[1], self.step.share_interval
        if decomposition is not None:
            norms = row_norms(decomposition.factors[3])
        context, states = ShareContext(norms, returns[:, -n_episodes:].T.copy(), rng), None
        if self._sharing.needs_changes:
            known = np.zeros(0, dtype=np.int64), np.zeros((self._n_agents, 0, self._n_actions), dtype=np.int64)
            if self._n_agents > 1:
                known = self.snapshots.changes(logs, self.places.place(episode - n_episodes + 1))
                states = known[0]
            context = context._replace(states=known[0], rows=q[:, known[0]], changes=known[1])
        mixture = self._sharing.mix(context)
        if mixture is not None and mixture.ndim == 1:
            states = self.snapshots.touched(logs) if self.places.length else None
        return mixture, states

    def _tables(self, logs: tuple[ChangeLog, ...], episode: int) -> tuple[FloatArray, float, float]:
        """Return the window's tables, a number that is 0 or infinite where their largest is, and their unit.

        The unit is a power of two where they are huge.
        """
        places = self.places.of_window(episode, self.step.every)
        with np.errstate(over="ignore", invalid="ignore"):
            tensor = self.snapshots.tensor(logs, places)
            if _USUAL_ENERGY[0] < np.vdot(tensor, tensor) < _USUAL_ENERGY[1]:
                return tensor, 1.0, 1.0
            largest = max(tensor.max(initial=0.0), -tensor.min(initial=0.0))
            if largest < _HUGE:
                return tensor, float(largest), 1.0
            tensor = self.snapshots.tensor(logs, places, _UNIT)
        return tensor, float(np.abs(tensor).max()), _UNIT

    def _decomposed(
        self, tensor: FloatArray, largest: float, episode: int
    ) -> tuple[TuckerDecomposition | None, tuple[int, ...]]:
        """Return the decomposition of a window's tables, None of zeros or where there is none, and its ranks."""
        if largest == 0.0:  # nothing was learned yet
            return None, _NO_RANKS
        try:
            decomposition = decompose(tensor, self._ranks, self.step.tol, self.step.max_iterations)
        except DecompositionError as error:
            self._warn(DecompositionWarning, _NOT_DECOMPOSED.format(error))
            return None, _FAILED
        self._loadings = partial(loadings_of, decomposition, self.snapshots.changed, episode)
        if isinstance(self._ranks, tuple) and decomposition.ranks != self._ranks:
            self._warn(
                RankWarning,
                f"ranks {self._ranks} are more than the tables of a window allow and were clipped to "
                f"{decomposition.ranks}; later windows may be clipped otherwise (see tensor_step_history.ranks)",
            )
        return decomposition, decomposition.ranks

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
        every, n_agents, n_actions = self.step.interval, self._n_agents, self._n_actions
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
        sizes = (self.snapshots.n_states, n_actions, self.step.every, n_agents)
        ranks = self._ranks if isinstance(self._ranks, tuple) else sizes
        loadings = read_loadings(arrays.group("loadings"), sizes, ranks, episodes)
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


def _last_episode(decomposition: TuckerDecomposition, n_rows: int) -> FloatArray:
    """Return what a decomposition says of the first rows of the tables after the last episode, (N, rows, A)."""
    of_states, of_actions, of_episodes, of_agents = decomposition.factors
    last = np.tensordot(decomposition.core, of_episodes[-1], axes=([2], [0]))  # (r_0, r_1, r_3)
    last = np.tensordot(of_agents, last, axes=([1], [2]))  # (N, r_0, r_1)
    rows: FloatArray = of_states[:n_rows] @ last @ of_actions.T
    return rows
