"""What every learner is: parameters checked once, tables for N agents, and a loop over windows of episodes.

A learner's own file holds its update, its kernel and a thin class that says how one agent plays the next episodes.
Everything else is here: seeds, the window loop with its tensor step, accounts, prediction, and saving.
"""

import warnings
from abc import ABC, abstractmethod
from os import PathLike
from pathlib import Path
from typing import Any, Literal, Self, TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike

from tuckerl._version import __version__
from tuckerl.checks import check_int, check_name, check_real
from tuckerl.errors import DivergenceWarning, ParameterError, ParameterTypeError, SavedFileError
from tuckerl.generalization.change_log import CLOCK, ENTRIES, EPISODES, ChangeLog, empty_log
from tuckerl.generalization.step import StepHistory, StepRun, TensorStep
from tuckerl.learners.episodes import Record, Settings, empty_record
from tuckerl.learners.saved import Arrays, read_saved, write_saved
from tuckerl.problems.mdp import MDPArrays, TabularMDP
from tuckerl.problems.resolve import Environment, as_problem
from tuckerl.rng import child, seed_sequence, stream
from tuckerl.types import FloatArray, IntArray, Seed

_CHUNK = 100  # episodes in one call of a kernel without a tensor step: Ctrl-C is heard between calls
_MAX_TRAJECTORY = 1_000_000  # states of the latest episode that are kept
_PREDICTION_STREAM = 2**32 - 2  # the child of the seed for predict(deterministic=False)


class LearnerParameters(TypedDict, total=False):
    """The keyword parameters that all learners take; see :class:`Learner`."""

    alpha: float
    gamma: float
    epsilon: float
    epsilon_decay: float
    ties: Literal["random", "first"]
    initial_q: float | ArrayLike
    n_agents: int
    tensor_step: TensorStep | None
    seed: Seed


class Learner(ABC):
    """A tabular learner of N agents, each in its own copy of the problem.

    Parameters
    ----------
    env
        A Gymnasium id or environment that carries its transitions, a callable that makes one, a
        :class:`~tuckerl.TabularMDP` or a :class:`~tuckerl.Maze`.
    alpha : float in (0, 1]
        Learning rate.
    gamma : float in [0, 1]
        Discount.
    epsilon : float in [0, 1]
        Probability of a random action.
    epsilon_decay : float in [0, 1]
        Multiplies epsilon after each episode.
    ties : "random" or "first"
        Which of several maximal actions is greedy.
    initial_q : float or (S, A) array
        The tables' first values.
    n_agents : int
    tensor_step : TensorStep, optional
        None is the unmodified algorithm; with a step it is the paper's T-version.
    seed : int or SeedSequence, optional
        Agent j draws from its child j. None takes a fresh seed.

    Raises
    ------
    ParameterError, ParameterTypeError, UnknownNameError
        If a parameter is out of its range, of the wrong type or not a known name.
    ProblemError
        If `env` is no problem that this learner can play.
    """

    def __init__(self, env: Environment, **parameters: Unpack[LearnerParameters]) -> None:
        unknown = set(parameters) - set(LearnerParameters.__annotations__)
        if unknown:
            known = ", ".join(LearnerParameters.__annotations__)
            raise ParameterTypeError(f"{type(self).__name__} has no parameter {min(unknown)!r}; it takes {known}")
        self.alpha = check_real("alpha", parameters.get("alpha", 0.1), 0.0, 1.0, low_open=True)
        self.gamma = check_real("gamma", parameters.get("gamma", 0.95), 0.0, 1.0)
        self.epsilon = check_real("epsilon", parameters.get("epsilon", 0.1), 0.0, 1.0)
        self.epsilon_decay = check_real("epsilon_decay", parameters.get("epsilon_decay", 1.0), 0.0, 1.0)
        self.ties = check_name("ties", parameters.get("ties", "random"), ("random", "first"))
        self.n_agents = check_int("n_agents", parameters.get("n_agents", 1), 1)
        self.tensor_step = _check_step(parameters.get("tensor_step"))
        self.diverged_at: int | None = None
        """The episode in which a table left the finite numbers; learning stopped before it."""
        self._sequence = seed_sequence(parameters.get("seed"))
        self.problem: TabularMDP = as_problem(env)
        """The finite MDP that is played."""
        shape = (self.problem.n_states, self.problem.n_actions)
        self._initial_q = _check_initial_q(parameters.get("initial_q", 0.0), shape)
        self._allocate(shape)

    def _allocate(self, shape: tuple[int, int]) -> None:
        step = self.tensor_step
        every = step.every if step is not None and step.needs_decomposition else 0
        limit = self.problem.max_episode_steps or 0
        self._settings = Settings(self.alpha, self.gamma, self.epsilon_decay, self.ties == "random")
        self._q: FloatArray = np.zeros((self.n_agents, *shape))  # zeros cost nothing until they are touched
        if self._initial_q.any():
            self._q += self._initial_q
        self._weights: FloatArray = np.ones(shape[1])
        self._streams = [stream(child(self._sequence, agent)) for agent in range(self.n_agents)]
        self._epsilon: FloatArray = np.full((self.n_agents, 1), self.epsilon)
        self._trajectory: IntArray = np.zeros((self.n_agents, min(limit, _MAX_TRAJECTORY) + 1), dtype=np.int64)
        self._logs: tuple[ChangeLog, ...] = tuple(empty_log(*shape, every) for _ in range(self.n_agents))
        self._steps: IntArray = np.zeros((0, self.n_agents), dtype=np.int64)
        self._returns: FloatArray = np.zeros((0, self.n_agents))
        self._run = None if step is None else StepRun(step, self._initial_q, self.n_agents, self._sequence)
        self._prediction_rng = np.random.default_rng(child(self._sequence, _PREDICTION_STREAM))

    @abstractmethod
    def _play(self, agent: int, record: Record) -> int:
        """Let an agent play and learn the episodes that `record` has room for; return how many stayed finite."""

    # -- learning ---------------------------------------------------------------------------------------------------

    def learn(self, episodes: int) -> Self:
        """Play and learn `episodes` more episodes with every agent.

        Learning 50 and then 50 equals learning 100, to the last bit. A run whose tables leave the finite numbers
        stops there, with a :class:`~tuckerl.errors.DivergenceWarning`; see `diverged_at`.

        Raises
        ------
        ParameterError, ParameterTypeError
            If `episodes` is not a whole number of at least 1.
        """
        goal = self.episodes + check_int("episodes", episodes, 1)
        while self.episodes < goal and self.diverged_at is None:
            self._learn_chunk(min(goal - self.episodes, self._until_step()))
        if self.diverged_at is not None:
            warnings.warn(
                f"a table left the finite numbers in episode {self.diverged_at}, where learning stopped: "
                "a smaller alpha may keep it finite",
                DivergenceWarning,
                stacklevel=2,
            )
        return self

    def _until_step(self) -> int:
        every = _CHUNK if self.tensor_step is None else self.tensor_step.every
        return every - self.episodes % every

    def _learn_chunk(self, n_episodes: int) -> None:
        records = [
            empty_record(n_episodes, self._trajectory[agent], self._epsilon[agent]) for agent in range(self.n_agents)
        ]
        finite = min(self._play(agent, record) for agent, record in enumerate(records))
        self._steps = np.concatenate([self._steps, np.stack([r.steps[:finite] for r in records], axis=1)])
        self._returns = np.concatenate([self._returns, np.stack([r.returns[:finite] for r in records], axis=1)])
        if finite < n_episodes:
            self.diverged_at = self.episodes
        elif self._run is not None and self.episodes % self._run.step.every == 0:
            self._generalize(self._run)

    def _generalize(self, run: StepRun) -> None:
        outcome = run.close_window(self.episodes, self._weights, self._logs, self._returns[-run.step.every :])
        if not outcome.finite:
            self._steps, self._returns = self._steps[:-1], self._returns[:-1]
            self.diverged_at = self.episodes
            return
        self._weights = outcome.weights
        if outcome.mixture is not None and self.n_agents > 1:
            self._share(outcome.mixture, run)
        if run.step.needs_decomposition:
            run.snapshots.restart(self._logs, self._q)

    def _share(self, mixture: FloatArray, run: StepRun) -> None:
        """Let every agent go on with the mixture of all tables."""
        # Rows that nobody touched are equal in all tables, and where the rows are known only those are mixed.
        rows: Any = run.snapshots.states if run.step.needs_decomposition else slice(None)
        if np.count_nonzero(mixture) == 1:
            self._q[:, rows] = self._q[int(np.argmax(mixture)), rows]
        else:
            self._q[:, rows] = np.tensordot(mixture, self._q[:, rows], axes=1)

    # -- what was learned -------------------------------------------------------------------------------------------

    @property
    def episodes(self) -> int:
        """Number of episodes finished."""
        return int(self._steps.shape[0])

    @property
    def steps(self) -> IntArray:
        """Steps of each episode, (episodes, n_agents)."""
        return self._steps.copy()

    @property
    def returns(self) -> FloatArray:
        """Undiscounted return of each episode, (episodes, n_agents)."""
        return self._returns.copy()

    @property
    def q(self) -> FloatArray:
        """A copy of the tables, (n_agents, S, A)."""
        return self._q.copy()

    @property
    def action_weights(self) -> FloatArray:
        """The learning-rate weight of each action, (A,); ones before the first window ends."""
        return self._weights.copy()

    @property
    def step_history(self) -> StepHistory:
        """The weights and the chosen agent of every window; empty without a tensor step."""
        if self._run is None:
            n_actions = self.problem.n_actions
            none = np.zeros(0, dtype=np.int64)
            return StepHistory(none, np.zeros((0, n_actions)), none, np.zeros(0), np.zeros((0, 4), dtype=np.int64))
        return self._run.history

    @property
    def trajectories(self) -> tuple[IntArray, ...]:
        """Each agent's states in its latest episode, in order, the last one included."""
        if self.episodes == 0:
            return tuple(np.zeros(0, dtype=np.int64) for _ in range(self.n_agents))
        return tuple(self._trajectory[agent, : n + 1].copy() for agent, n in enumerate(self._steps[-1]))

    def predict(self, observation: ArrayLike, deterministic: bool = True) -> tuple[Any, None]:
        """Return agent 0's greedy action for a state or an array of states, and None, as Stable-Baselines3 does.

        The lowest action wins ties. With ``deterministic=False`` it is random with the present probability epsilon.

        Raises
        ------
        ParameterError, ParameterTypeError
            If an observation is not a state's number.
        """
        states = np.asarray(observation)
        if states.dtype.kind not in "iu":
            raise ParameterTypeError(f"an observation must be a state's number; got {observation!r}")
        if states.size and (states.min() < 0 or states.max() >= self.problem.n_states):
            raise ParameterError(
                f"an observation must be a state from 0 to {self.problem.n_states - 1}; got {observation!r}"
            )
        actions = np.argmax(self._q[0, states], axis=-1)
        if not deterministic:
            explores = self._prediction_rng.random(states.shape) < self._epsilon[0, 0]
            drawn = self._prediction_rng.integers(self.problem.n_actions, size=states.shape)
            actions = np.where(explores, drawn, actions)
        return (int(actions) if states.ndim == 0 else actions), None

    def __repr__(self) -> str:
        step = "" if self.tensor_step is None else f", {self.tensor_step}"
        return (
            f"{type(self).__name__}({self.problem}, alpha={self.alpha:g}, gamma={self.gamma:g}, "
            f"epsilon={self.epsilon:g}, n_agents={self.n_agents}{step}): {self.episodes} episodes"
        )

    # -- saving -----------------------------------------------------------------------------------------------------

    def save(self, path: str | PathLike[str]) -> None:
        """Write everything that is needed to go on, to the last bit, into one file (no pickle).

        Raises
        ------
        OutputError
            If it cannot be written.
        """
        write_saved(Path(path), self._saved_header(), self._saved_arrays())

    @classmethod
    def load(cls, path: str | PathLike[str], *, tensor_step: TensorStep | None = None) -> Self:
        """Return the learner that `save` wrote.

        `tensor_step` is needed only where the saved one used functions of the user's own.

        Raises
        ------
        SavedFileError
            If the file is truncated, damaged, of another kind or learner, or of a newer version.
        FileNotFoundError
            If there is none.
        """
        header, arrays = read_saved(Path(path))
        if header["learner"] != cls.__name__:
            raise SavedFileError(
                f"{path} holds a {header['learner']}, not a {cls.__name__}: load it with {header['learner']}.load"
            )
        problem_arrays: dict[str, Any] = {name: arrays[f"problem.{name}"] for name in _PROBLEM_ARRAYS}
        problem = TabularMDP.from_arrays(
            MDPArrays(**problem_arrays, **header["problem_scalars"]),
            header["n_states"],
            arrays.get("problem.heuristic"),
        )
        learner = cls(
            problem,
            **header["parameters"],
            **cls._array_parameters(arrays),
            tensor_step=_restored_step(header["tensor_step"], tensor_step, path),
            seed=np.random.SeedSequence(header["entropy"], spawn_key=tuple(header["spawn_key"])),
        )
        learner.diverged_at = header["diverged_at"]
        learner._restore_arrays(arrays)
        return learner

    def _parameters(self) -> dict[str, Any]:
        """Return the parameters that the constructor takes as JSON."""
        return {
            "alpha": self.alpha,
            "gamma": self.gamma,
            "epsilon": self.epsilon,
            "epsilon_decay": self.epsilon_decay,
            "ties": self.ties,
            "n_agents": self.n_agents,
        }

    @classmethod
    def _array_parameters(cls, arrays: Arrays) -> dict[str, Any]:
        """Return the parameters that the constructor takes as arrays."""
        initial_q = arrays["initial_q"]
        return {"initial_q": float(initial_q) if initial_q.ndim == 0 else initial_q}

    def _saved_header(self) -> dict[str, Any]:
        arrays = self.problem.arrays
        return {
            "tuckerl": __version__,
            "learner": type(self).__name__,
            "parameters": self._parameters(),
            "tensor_step": _saved_step(self.tensor_step),
            "entropy": self._sequence.entropy,
            "spawn_key": list(self._sequence.spawn_key),
            "n_states": self.problem.n_states,
            "problem_scalars": {n: getattr(arrays, n) for n in MDPArrays._fields if n not in _PROBLEM_ARRAYS},
            "diverged_at": self.diverged_at,
        }

    def _saved_arrays(self) -> Arrays:
        saved: Arrays = {f"problem.{name}": getattr(self.problem.arrays, name) for name in _PROBLEM_ARRAYS}
        if self.problem.heuristic is not None:
            saved["problem.heuristic"] = self.problem.heuristic
        uniform = self._initial_q.strides == (0, 0)
        saved["initial_q"] = self._initial_q[0, 0] if uniform else self._initial_q
        for name in _STATE_ARRAYS:
            saved[name] = getattr(self, f"_{name}")
        saved["streams"] = np.stack(self._streams)
        for agent, log in enumerate(self._logs):
            entries, episodes = log.cursor[ENTRIES], log.cursor[EPISODES]
            saved[f"log{agent}.state"] = log.state[:entries]
            saved[f"log{agent}.row"] = log.row[:entries]
            saved[f"log{agent}.end"] = log.end[:episodes]
        if self._run is not None:
            saved |= {f"step.{name}": array for name, array in self._run.saved().items()}
        return saved

    def _restore_arrays(self, arrays: Arrays) -> None:
        for name in _STATE_ARRAYS:
            setattr(self, f"_{name}", arrays[name])
        self._streams = list(arrays["streams"])
        for agent, log in enumerate(self._logs):
            state, row, end = (arrays[f"log{agent}.{name}"] for name in ("state", "row", "end"))
            log.state[: state.size], log.row[: state.size], log.end[: end.size] = state, row, end
            # Between episodes no row is marked, so the clock and its stamps may begin anew.
            log.cursor[ENTRIES], log.cursor[EPISODES], log.cursor[CLOCK] = state.size, end.size, 1
        if self._run is not None:
            prefix = "step."
            self._run.restore({n.removeprefix(prefix): a for n, a in arrays.items() if n.startswith(prefix)})


_PROBLEM_ARRAYS = tuple(name for name in MDPArrays._fields if name not in ("n_actions", "max_episode_steps"))
_STATE_ARRAYS = ("q", "weights", "epsilon", "trajectory", "steps", "returns")


def _check_step(step: object) -> TensorStep | None:
    if step is None or isinstance(step, TensorStep):
        return step
    raise ParameterTypeError(f"tensor_step must be a tuckerl.TensorStep or None; got {step!r}")


def _check_initial_q(initial_q: object, shape: tuple[int, int]) -> FloatArray:
    """Return the first table as (S, A); one number is broadcast, at no cost."""
    if np.ndim(initial_q) == 0:  # type: ignore[arg-type]  # what is no array is refused by check_real
        return np.broadcast_to(check_real("initial_q", initial_q), shape)
    table = np.array(initial_q, dtype=np.float64)
    if table.shape != shape or not np.isfinite(table).all():
        raise ParameterError(
            f"initial_q must be one finite number or finite numbers of shape {shape}; got shape {table.shape}"
        )
    return table


def _saved_step(step: TensorStep | None) -> dict[str, Any] | None:
    if step is None:
        return None
    if callable(step.weights) or callable(step.share):
        return {"functions": True}
    names = ("every", "ranks", "weights", "share", "floor", "tol", "max_iterations")
    return {name: getattr(step, name) for name in names}


def _restored_step(
    saved: dict[str, Any] | None, given: TensorStep | None, path: str | PathLike[str]
) -> TensorStep | None:
    if saved is None:
        return None
    if given is not None:
        return given
    if "functions" in saved:
        raise SavedFileError(
            f"{path} used a tensor step with functions of its own, which files cannot hold: pass tensor_step= to load"
        )
    return TensorStep(**saved)
