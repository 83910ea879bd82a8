"""What every learner holds and shows: parameters, tables for N agents, their history, prediction and evaluation."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar, Unpack

import numpy as np

from tuckerl.adapters.pettingzoo_problem import PettingZooProblem
from tuckerl.adapters.resolve import Agents, Environment, Problem, Reading, as_problem, check_compiled
from tuckerl.checks import check_flag, check_int, check_name, check_real
from tuckerl.generalization.change_log import ChangeLog, empty_log
from tuckerl.generalization.loadings import Loadings
from tuckerl.generalization.step import TensorStepHistory, TensorStepState, empty_history
from tuckerl.rng import child, seed_sequence, stream
from tuckerl.training.agent_arrays import Settings
from tuckerl.training.evaluation import Evaluation, evaluate
from tuckerl.training.history import EpisodeHistory
from tuckerl.training.parameters import (
    PLAIN_PARAMETERS,
    LearnerParameters,
    check_initial_q,
    check_known,
    check_size,
    check_step,
)
from tuckerl.training.prediction import predict
from tuckerl.training.schedules import Schedule, ScheduleValues, as_schedule
from tuckerl.types import BoolArray, FloatArray, IntArray, Seed

_MAX_TRAJECTORY = 1_000_000  # states of the latest episode that are kept
_PREDICTION_STREAM = 2**32 - 2  # the child of the seed for predict(deterministic=False)
_EVALUATION_STREAM = 2**32 - 3  # and that for evaluate()
_WINDOW = 100  # episodes between callbacks without a tensor step


class Tables(ABC):
    """The tables of a learner and all that goes with them; :class:`~tuckerl.training.learner.Learner` has the rest."""

    _agents: ClassVar[Agents] = Agents.INDEPENDENT  # what it makes of an environment of several agents

    team_reward: str = "mean"
    """What an environment of several agents pays a team: TeamQ lets it be chosen."""

    def __init__(self, env: Environment, **parameters: Unpack[LearnerParameters]) -> None:
        check_known(type(self), parameters)
        self.alpha: float | Schedule = parameters.get("alpha", 0.1)
        self.gamma = check_real("gamma", parameters.get("gamma", 0.95), 0.0, 1.0)
        self.epsilon: float | Schedule = parameters.get("epsilon", 0.1)
        self.epsilon_decay = check_real("epsilon_decay", parameters.get("epsilon_decay", 1.0), 0.0, 1.0)
        self._alphas = as_schedule("alpha", self.alpha, positive=True)
        self._epsilons = as_schedule("epsilon", self.epsilon, self.epsilon_decay)
        self.ties = check_name("ties", parameters.get("ties", "random"), ("random", "first"))
        self.n_agents = check_int("n_agents", parameters.get("n_agents", 1), 1)
        self.bootstrap_terminal = check_flag("bootstrap_terminal", parameters.get("bootstrap_terminal", False))
        self.tensor_step = check_step(parameters.get("tensor_step"))
        self.diverged_at: int | None = None
        """The episode in which a table left the finite numbers; learning stopped before it."""
        self._sequence = seed_sequence(parameters.get("seed"))
        self.compiled = check_compiled(parameters.get("compiled", "auto"))
        self.problem: Problem = as_problem(env, self.reading_of({**parameters, "team_reward": self.team_reward}))
        """What is played: arrays, compiled functions, or an environment that is stepped in Python."""
        self.n_tables = check_size(self.problem, self.n_agents, self.tensor_step)
        """Length of the agent axis: `n_agents`, or the number of a PettingZoo environment's agents."""
        shape = (self.problem.n_states, self.problem.n_actions)
        self._initial_q = check_initial_q(parameters.get("initial_q", 0.0), shape)
        self._allocate(shape)

    @classmethod
    def reading_of(cls, parameters: Mapping[str, Any]) -> Reading:
        """Return how a learner with these parameters reads its environment."""
        return Reading(cls._agents, parameters.get("bins"), parameters.get("compiled", "auto"))

    def _allocate(self, shape: tuple[int, int]) -> None:
        step, n_tables = self.tensor_step, self.n_tables
        every = step.every if step is not None and step.needs_decomposition else 0
        limit = min(self.problem.max_episode_steps or _MAX_TRAJECTORY, _MAX_TRAJECTORY)
        discount = self.gamma if self.bootstrap_terminal else 0.0
        self._settings = Settings(self.gamma, discount, self.ties == "random")
        together = isinstance(self.problem, PettingZooProblem)
        self._worlds = [self.problem.world() for _ in range(1 if together else n_tables)]
        for agent, world in enumerate(self._worlds):
            world.seed(child(self._sequence, agent))
        self._q: FloatArray = np.zeros((n_tables, *shape))  # zeros cost nothing until they are touched
        if self._initial_q.any():
            self._q += self._initial_q
        self._weights: FloatArray = np.ones(shape[1])
        self._step_sizes: FloatArray = np.zeros((n_tables, shape[1]))
        self._streams = [stream(child(self._sequence, table)) for table in range(n_tables)]
        self._trajectory: IntArray = np.zeros((n_tables, limit + 1), dtype=np.int64)
        self._logs: tuple[ChangeLog, ...] = tuple(empty_log(*shape, every) for _ in range(n_tables))
        self._accounts = EpisodeHistory(n_tables)
        self._known_course = ScheduleValues(self._alphas.values(0), self._epsilons.values(0))
        self._run = None if step is None else TensorStepState(step, self._initial_q, n_tables, self._sequence)
        self._prediction_rng = np.random.default_rng(child(self._sequence, _PREDICTION_STREAM))
        self._was_capped = False
        self._is_torn = np.zeros(n_tables, dtype=np.bool_)  # whose trajectory is one of an episode that was broken off

    @abstractmethod
    def _method(self, table: int) -> Any:
        """Return what the algorithm keeps for a table, as its kernels read it."""

    @property
    def episodes(self) -> int:
        """Number of episodes finished."""
        return self._accounts.episodes

    @property
    def first_agent_steps(self) -> int:
        """Steps of the first agent in all its episodes: what ``learn(steps=...)`` counts."""
        return self._accounts.first_steps

    @property
    def window(self) -> int:
        """Episodes from one tensor step to the next; without one, from one call of callbacks to the next."""
        return _WINDOW if self._run is None else self._run.step.every

    @property
    def is_intact(self) -> bool:
        """Whether no table has left the finite numbers, and no error has broken off the latest episode."""
        return self.diverged_at is None and not bool(self._is_torn.any())

    @property
    def steps(self) -> IntArray:
        """Steps of each episode, (episodes, n_tables)."""
        return self._accounts.steps.T.copy()

    @property
    def returns(self) -> FloatArray:
        """Undiscounted return of each episode, (episodes, n_tables)."""
        return self._accounts.returns.T.copy()

    @property
    def q(self) -> FloatArray:
        """A copy of the tables, (n_tables, S, A)."""
        return self._q.copy()

    @property
    def action_mask(self) -> BoolArray | None:
        """Where an action may be taken, as far as is known, (n_tables, S, A); None where all may."""
        tables = [table for world in self._worlds for table in world.action_masks]
        return np.stack(tables) if all(table.size for table in tables) else None

    @property
    def action_weights(self) -> FloatArray:
        """The learning-rate weight of each action, (A,); ones before the first window ends."""
        return self._weights.copy()

    @property
    def tensor_step_history(self) -> TensorStepHistory:
        """The weights and the chosen agent of every window; empty without a tensor step."""
        return empty_history(self.problem.n_actions) if self._run is None else self._run.history

    @property
    def loadings(self) -> Loadings | None:
        """The factors of the latest window that the tensor step has decomposed; None before that."""
        return None if self._run is None else self._run.loadings

    @property
    def tensor_step_seconds(self) -> float:
        """Processor time that the tensor step has taken since this learner was made or loaded."""
        return 0.0 if self._run is None else self._run.seconds

    @property
    def trajectories(self) -> tuple[IntArray, ...]:
        """Each agent's states in its latest episode, a million at most; none if there is none that was whole."""
        is_whole = self._accounts.is_even and self.is_intact
        if self.episodes == 0 or not is_whole:
            return tuple(np.zeros(0, dtype=np.int64) for _ in range(self.n_tables))
        last = self._accounts.steps[:, -1]
        return tuple(self._trajectory[table, : n + 1].copy() for table, n in enumerate(last))

    def _course(self, n_episodes: int) -> ScheduleValues:
        """Return the numbers that change from episode to episode, for so many episodes at least."""
        if self._known_course.alpha.size < n_episodes:
            more = max(n_episodes, 2 * self._known_course.alpha.size)
            self._known_course = ScheduleValues(self._alphas.values(more), self._epsilons.values(more))
        return self._known_course

    def to_frame(self) -> Any:
        """Return the history as a Polars frame: a row for each agent and episode, with its steps and return."""
        import polars as pl  # takes longer to import than all the rest

        table, episode = np.meshgrid(np.arange(self.n_tables), np.arange(self.episodes), indexing="ij")
        columns = {"agent": table, "episode": episode, "steps": self._accounts.steps, "return": self._accounts.returns}
        return pl.DataFrame({name: values.ravel() for name, values in columns.items()})

    def predict(self, observation: Any, deterministic: bool = True) -> tuple[Any, None]:
        """Return agent 0's greedy action for an observation or a batch of them, and None, as Stable-Baselines3 does.

        Observations and actions are the environment's own; for a problem of this library they are numbers. Of a
        PettingZoo environment's agents they are dicts by agent; of a team whose joint transitions were lifted, the
        numbers of joint states, as ``env.state()`` gives them, and of joint actions. The lowest action wins ties; masks
        that were seen while learning are honoured. With ``deterministic=False`` actions are random with the present
        probability epsilon.

        Raises
        ------
        ParameterError, ParameterTypeError, ObservationError
            If an observation is none of the environment's.
        """
        epsilon = 0.0 if deterministic else float(self._course(self.episodes + 1).epsilon[self.episodes])
        action_masks = [table for world in self._worlds for table in world.action_masks]
        return predict(self.problem, self._q, action_masks, observation, epsilon, self._prediction_rng), None

    def evaluate(self, episodes: int = 100, *, seed: Seed = None) -> Evaluation:
        """Play greedy episodes apart from learning, which goes on as if they had not been.

        The policy is `predict`'s. The environment is a copy, and every call draws from the same stream, so that two
        calls without learning between them agree, unless `seed` gives another one. Without a time limit, episodes are
        cut off after 100,000 steps.

        Raises
        ------
        ProblemError
            If the environment cannot be copied.
        """
        return self._evaluate(self._q, check_int("episodes", episodes, 1), seed)

    def _evaluate(self, q: FloatArray, episodes: int, seed: Seed) -> Evaluation:
        """Evaluate tables, which may be those of an earlier learner of the same run."""
        sequence = child(self._sequence, _EVALUATION_STREAM) if seed is None else seed_sequence(seed)
        return evaluate(self.problem, q, episodes, sequence)

    @property
    def parameters(self) -> dict[str, Any]:
        """What its constructor was given or took by default, but for arrays, the seed and the tensor step."""
        return self._parameters()

    def __repr__(self) -> str:
        parameters = self._parameters() | {"tensor_step": self.tensor_step}
        listed = ", ".join(f"{name}={value!r}" for name, value in parameters.items())
        return f"{type(self).__name__}({self.problem}, {listed}): {self.episodes} episodes"

    def _parameters(self) -> dict[str, Any]:
        """Return the parameters that the constructor takes as JSON."""
        return {name: getattr(self, name) for name in PLAIN_PARAMETERS}
