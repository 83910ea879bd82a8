"""What every learner is: parameters checked once, tables for N agents, and a loop over windows of episodes.

A learner's own file holds its update, its kernel and a thin class that says how one agent plays the next episodes.
Everything else is here: seeds, the window loop with its tensor step, accounts, prediction, and saving.
"""

import warnings
from abc import ABC, abstractmethod
from os import PathLike
from pathlib import Path
from typing import Any, Self, Unpack

import numpy as np
from numpy.typing import ArrayLike

from tuckerl._version import __version__
from tuckerl.checks import check_flag, check_int, check_name, check_real
from tuckerl.errors import DivergenceWarning, SavedFileError
from tuckerl.generalization.change_log import ChangeLog, empty_log, restore_log, saved_log
from tuckerl.generalization.sharing import share_tables
from tuckerl.generalization.step import StepHistory, StepRun, TensorStep, empty_history
from tuckerl.learners import saved
from tuckerl.learners.episodes import Record, Settings
from tuckerl.learners.interrupts import interrupts_held_back
from tuckerl.learners.parameters import LearnerParameters, check_initial_q, check_known, check_observation, check_step
from tuckerl.problems.resolve import Environment, Problem, as_problem
from tuckerl.problems.simulator import check_world
from tuckerl.rng import child, seed_sequence, stream
from tuckerl.types import FloatArray, IntArray

_PLAIN_PARAMETERS = ("alpha", "gamma", "epsilon", "epsilon_decay", "ties", "n_agents", "bootstrap_terminal")
_DIVERGED = "a table left the finite numbers in episode {}, where learning stopped: a smaller alpha may keep it finite"
_CHUNK = 100  # episodes in one call of a kernel without a tensor step: Ctrl-C is heard between calls
_MAX_TRAJECTORY = 1_000_000  # states of the latest episode that are kept
_PREDICTION_STREAM = 2**32 - 2  # the child of the seed for predict(deterministic=False)


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
    bootstrap_terminal : bool
        Whether a terminal state's value counts as any other's (some older programs did so); by default it is 0.
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

    _teams = False  # whether it plays parallel environments by joint actions

    def __init__(self, env: Environment, **parameters: Unpack[LearnerParameters]) -> None:
        check_known(type(self), parameters)
        self.alpha = check_real("alpha", parameters.get("alpha", 0.1), 0.0, 1.0, low_open=True)
        self.gamma = check_real("gamma", parameters.get("gamma", 0.95), 0.0, 1.0)
        self.epsilon = check_real("epsilon", parameters.get("epsilon", 0.1), 0.0, 1.0)
        self.epsilon_decay = check_real("epsilon_decay", parameters.get("epsilon_decay", 1.0), 0.0, 1.0)
        self.ties = check_name("ties", parameters.get("ties", "random"), ("random", "first"))
        self.n_agents = check_int("n_agents", parameters.get("n_agents", 1), 1)
        self.bootstrap_terminal = check_flag("bootstrap_terminal", parameters.get("bootstrap_terminal", False))
        self.tensor_step = check_step(parameters.get("tensor_step"))
        self.diverged_at: int | None = None
        """The episode in which a table left the finite numbers; learning stopped before it."""
        self._sequence = seed_sequence(parameters.get("seed"))
        self.problem: Problem = as_problem(env, teams=self._teams)
        """The finite MDP that is played."""
        shape = (self.problem.n_states, self.problem.n_actions)
        self._initial_q = check_initial_q(parameters.get("initial_q", 0.0), shape)
        self._allocate(shape)

    def _allocate(self, shape: tuple[int, int]) -> None:
        step = self.tensor_step
        every = step.every if step is not None and step.needs_decomposition else 0
        limit = self.problem.max_episode_steps or _MAX_TRAJECTORY
        discount = self.gamma if self.bootstrap_terminal else 0.0
        self._settings = Settings(self.gamma, self.epsilon_decay, discount, self.ties == "random")
        self._worlds = tuple(self.problem.world() for _ in range(self.n_agents))
        self._q: FloatArray = np.zeros((self.n_agents, *shape))  # zeros cost nothing until they are touched
        if self._initial_q.any():
            self._q += self._initial_q
        self._weights: FloatArray = np.ones(shape[1])
        self._streams = [stream(child(self._sequence, agent)) for agent in range(self.n_agents)]
        self._epsilon: FloatArray = np.full((self.n_agents, 1), self.epsilon)
        self._trajectory: IntArray = np.zeros((self.n_agents, min(limit, _MAX_TRAJECTORY) + 1), dtype=np.int64)
        self._logs: tuple[ChangeLog, ...] = tuple(empty_log(*shape, every) for _ in range(self.n_agents))
        # By agent and episode, with room for all that learn() was asked for.
        self._steps: IntArray = np.zeros((self.n_agents, 0), dtype=np.int64)
        self._returns: FloatArray = np.zeros((self.n_agents, 0))
        self._n_episodes = 0
        self._run = None if step is None else StepRun(step, self._initial_q, self.n_agents, self._sequence)
        self._prediction_rng = np.random.default_rng(child(self._sequence, _PREDICTION_STREAM))

    @abstractmethod
    def _play(self, agent: int, record: Record) -> int:
        """Let an agent play and learn the episodes that `record` has room for; return how many stayed finite."""

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
        room = ((0, 0), (0, goal - self.episodes))
        self._steps = np.pad(self._steps[:, : self.episodes], room)
        self._returns = np.pad(self._returns[:, : self.episodes], room)
        while self.diverged_at is None:
            due = self._due_step()
            if due is None and self.episodes == goal:
                break
            with interrupts_held_back():
                if due is not None:
                    self._generalize(due)
                else:
                    chunk = _CHUNK if self._run is None else self._run.step.every
                    self._play_chunk(min(goal - self.episodes, chunk - self.episodes % chunk))
        if self.diverged_at is not None:
            warnings.warn(_DIVERGED.format(self.diverged_at), DivergenceWarning, stacklevel=2)
        return self

    def _due_step(self) -> StepRun | None:
        """Return the tensor step if a window has ended and it has not followed yet (a user's function may raise)."""
        run = self._run
        return run if run is not None and run.n_windows < self.episodes // run.step.every else None

    def _play_chunk(self, n_episodes: int) -> None:
        chunk = slice(self.episodes, self.episodes + n_episodes)
        finite = n_episodes
        for agent in range(self.n_agents):
            record = Record(
                self._steps[agent, chunk], self._returns[agent, chunk], self._trajectory[agent], self._epsilon[agent]
            )
            finite = min(finite, self._play(agent, record))
            check_world(self._worlds[agent])
        self._n_episodes += finite
        if finite < n_episodes:
            self.diverged_at = self.episodes

    def _generalize(self, run: StepRun) -> None:
        window = self._returns[:, self.episodes - run.step.every : self.episodes].T.copy()
        outcome = run.close_window(self.episodes, self._weights, self._logs, window)
        if not outcome.finite:
            self._n_episodes -= 1
            self.diverged_at = self.episodes
            return
        self._weights = outcome.weights
        if outcome.mixture is not None and self.n_agents > 1:
            self._share(outcome.mixture)
        if run.step.needs_decomposition:
            run.snapshots.restart(self._logs, self._q)

    def _share(self, mixture: FloatArray) -> None:
        """Let every agent go on with the mixture of all tables."""
        known = self._run.snapshots.states if self._run is not None and self._run.step.needs_decomposition else None
        share_tables(self._q, mixture, known)

    @property
    def episodes(self) -> int:
        """Number of episodes finished."""
        return self._n_episodes

    @property
    def steps(self) -> IntArray:
        """Steps of each episode, (episodes, n_agents)."""
        return self._steps[:, : self.episodes].T.copy()

    @property
    def returns(self) -> FloatArray:
        """Undiscounted return of each episode, (episodes, n_agents)."""
        return self._returns[:, : self.episodes].T.copy()

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
        return empty_history(self.problem.n_actions) if self._run is None else self._run.history

    @property
    def step_seconds(self) -> float:
        """Processor time that the tensor step has taken since this learner was made or loaded."""
        return 0.0 if self._run is None else self._run.seconds

    @property
    def trajectories(self) -> tuple[IntArray, ...]:
        """Each agent's states in its latest episode, a million at most; none before the first or after divergence."""
        if self.episodes == 0 or self.diverged_at is not None:
            return tuple(np.zeros(0, dtype=np.int64) for _ in range(self.n_agents))
        last = self._steps[:, self.episodes - 1]
        return tuple(self._trajectory[agent, : n + 1].copy() for agent, n in enumerate(last))

    def predict(self, observation: ArrayLike, deterministic: bool = True) -> tuple[Any, None]:
        """Return agent 0's greedy action for a state or an array of states, and None, as Stable-Baselines3 does.

        The lowest action wins ties. With ``deterministic=False`` it is random with the present probability epsilon.

        Raises
        ------
        ParameterError, ParameterTypeError
            If an observation is not a state's number.
        """
        states = check_observation(observation, self.problem.n_states)
        actions = np.argmax(self._q[0, states], axis=-1)
        if not deterministic:
            explores = self._prediction_rng.random(states.shape) < self._epsilon[0, 0]
            drawn = self._prediction_rng.integers(self.problem.n_actions, size=states.shape)
            actions = np.where(explores, drawn, actions)
        return (int(actions) if states.ndim == 0 else actions), None

    def __repr__(self) -> str:
        parameters = self._parameters() | {"tensor_step": self.tensor_step}
        listed = ", ".join(f"{name}={value!r}" for name, value in parameters.items())
        return f"{type(self).__name__}({self.problem}, {listed}): {self.episodes} episodes"

    def save(self, path: str | PathLike[str]) -> None:
        """Write everything that is needed to go on, to the last bit, into one file (no pickle).

        Raises
        ------
        OutputError
            If it cannot be written.
        """
        problem_header, problem_arrays = saved.problem_parts(self.problem)
        header = {
            "tuckerl": __version__,
            "learner": type(self).__name__,
            "problem": problem_header,
            "parameters": self._parameters(),
            "tensor_step": saved.step_parts(self.tensor_step),
            "seed": saved.seed_parts(self._sequence),
            "prediction_rng": self._prediction_rng.bit_generator.state,
            "diverged_at": self.diverged_at,
        }
        arrays = saved.with_prefix("problem", problem_arrays) | self._saved_arrays()
        saved.write(Path(path), header, arrays)

    @classmethod
    def load(
        cls,
        path: str | PathLike[str],
        *,
        env: Environment | None = None,
        tensor_step: TensorStep | None = None,
    ) -> Self:
        """Return the learner that `save` wrote.

        What is code is in no file: `env` is needed where the problem is a simulator, `tensor_step` where the saved one
        used functions of the user's own; both as they were.

        Raises
        ------
        SavedFileError
            If the file is truncated, damaged, of another kind or learner, or of a newer version.
        ParameterError
            If `env` or `tensor_step` is not the one that it was saved with.
        FileNotFoundError
            If there is none.
        """
        header, arrays = saved.read(Path(path))
        if header["learner"] != cls.__name__:
            held = header["learner"]
            raise SavedFileError(f"{path} holds a {held}, not a {cls.__name__}: load it with {held}.load")
        learner = cls(
            saved.restored_problem(header["problem"], saved.of_prefix("problem", arrays), env, Path(path)),
            **header["parameters"],
            **cls._array_parameters(arrays),
            tensor_step=saved.restored_step(header["tensor_step"], tensor_step, Path(path)),
            seed=saved.restored_seed(header["seed"]),
        )
        learner.diverged_at = header["diverged_at"]
        learner._prediction_rng.bit_generator.state = header["prediction_rng"]
        learner._restore_arrays(arrays)
        return learner

    def _parameters(self) -> dict[str, Any]:
        """Return the parameters that the constructor takes as JSON."""
        return {name: getattr(self, name) for name in _PLAIN_PARAMETERS}

    @classmethod
    def _array_parameters(cls, arrays: saved.Arrays) -> dict[str, Any]:
        """Return the parameters that the constructor takes as arrays."""
        initial_q = arrays["initial_q"]
        return {"initial_q": float(initial_q) if initial_q.ndim == 0 else initial_q}

    def _saved_arrays(self) -> saved.Arrays:
        """Return all that learning changes, and the parameters that are arrays."""
        uniform = self._initial_q.strides == (0, 0)
        longest = int(self._steps[:, self.episodes - 1].max()) + 1 if self.episodes else 0
        arrays: saved.Arrays = {
            "initial_q": self._initial_q[0, 0] if uniform else self._initial_q,
            "q": self._q,
            "weights": self._weights,
            "epsilon": self._epsilon,
            "steps": self._steps[:, : self.episodes],
            "returns": self._returns[:, : self.episodes],
            "trajectory": self._trajectory[:, :longest],
            "streams": np.stack(self._streams),
        }
        for agent, log in enumerate(self._logs):
            arrays |= saved.with_prefix(f"log{agent}", saved_log(log))
        return arrays if self._run is None else arrays | saved.with_prefix("step", self._run.saved())

    def _restore_arrays(self, arrays: saved.Arrays) -> None:
        """Go on from what `_saved_arrays` returned."""
        self._q, self._weights, self._epsilon = arrays["q"], arrays["weights"], arrays["epsilon"]
        self._steps, self._returns = arrays["steps"], arrays["returns"]
        self._n_episodes = self._steps.shape[1]
        self._trajectory[:, : arrays["trajectory"].shape[1]] = arrays["trajectory"]
        self._streams = list(arrays["streams"])
        for agent, log in enumerate(self._logs):
            restore_log(log, saved.of_prefix(f"log{agent}", arrays))
        if self._run is not None:
            self._run.restore(saved.of_prefix("step", arrays))
