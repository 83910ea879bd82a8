"""What every learner is: parameters that are checked once, tables of N agents, and how they are learned and used.

A learner's own file holds its state, its kernels and a thin class. The base class here is put together from parts: what
learning changes (`training_state`) and what of it is shown (`learned`), learning itself (`trainer`), prediction and
evaluation (`prediction`, `evaluation`) and files (`persistence`).
"""

from collections.abc import Callable, Mapping, Sequence
from inspect import signature
from os import PathLike
from typing import Any, ClassVar, Literal, Self

import numpy as np
from numpy.typing import ArrayLike

from tuckerl.adapters.judging import judged_in
from tuckerl.adapters.resolve import AdapterOptions, Agents, Environment, as_problem, check_compiled
from tuckerl.checks import check_flag, check_int, check_name, check_path, check_real
from tuckerl.errors import (
    DivergenceWarning,
    LearnerError,
    SavedFileError,
    SavedFileMissingError,
    warn,
)
from tuckerl.generalization.tensor_step import TensorStep
from tuckerl.memory import check_memory
from tuckerl.problems.problem import Problem
from tuckerl.rng import child, seed_sequence
from tuckerl.training import persistence
from tuckerl.training.agent_arrays import Settings
from tuckerl.training.algorithm import KEEP_MAXIMA, check_registered
from tuckerl.training.callbacks.base import CallbackLike
from tuckerl.training.copies import Copyable
from tuckerl.training.declared_state import Declaration
from tuckerl.training.evaluation import Evaluation, evaluate
from tuckerl.training.habits import answering_habits, check_positions
from tuckerl.training.learner_file import reading
from tuckerl.training.memory_account import learner_parts
from tuckerl.training.one_owner import Owner
from tuckerl.training.parameters import (
    check_alpha,
    check_deterministic,
    check_equal_spaces,
    check_initial_q,
    check_known,
    check_policy,
    check_step,
    merged_signature,
    with_parameters,
)
from tuckerl.training.policies.greedy import Greedy
from tuckerl.training.policies.policy import Policy, check_policy_registered
from tuckerl.training.prediction import Predictor
from tuckerl.training.python_calls import PythonCall
from tuckerl.training.rules import Rules
from tuckerl.training.schedules import Schedule, as_number
from tuckerl.training.trainer import Trainer
from tuckerl.training.training_state import TrainingState
from tuckerl.types import FloatArray, Seed

_PREDICTION_STREAM = 2**32 - 2  # the child of the seed for predictions that are drawn
_EVALUATION_STREAM = 2**32 - 3  # and that for evaluate()
_DIVERGED = "a table was not finite any more in episode {}, where learning stopped: a smaller alpha may keep it finite"


class Learner(Copyable):
    """A tabular learner of N agents, each in its own copy of the problem.

    Parameters
    ----------
    env
        A Gymnasium environment or PettingZoo parallel environment: its id, an instance or a callable that makes one; or
        a :class:`~tuckerl.TabularMDP`, a :class:`~tuckerl.Simulator` or a :class:`~tuckerl.Maze`. Every agent of a
        PettingZoo environment has a table of its own, and `n_agents` is their number; :class:`~tuckerl.TeamQ` has one
        table for all.
    alpha : float in (0, 1] or Schedule
        Learning rate; a schedule such as ``tuckerl.Harmonic(0.5, half_after=1000)`` changes it from episode to episode.
    gamma : float in [0, 1]
        Discount.
    epsilon : float in [0, 1] or Schedule, optional
        Probability of a random action, 0.1 by default: the short way to ``policy=tuckerl.EpsilonGreedy(epsilon)``.
    epsilon_decay : float in [0, 1]
        Multiplies epsilon after each episode.
    ties : "random" or "first"
        Which of several maximal actions is greedy.
    initial_q : float or (S, A) array
        The tables' first values; high ones are an optimistic start, which explores.
    n_agents : int
    bootstrap_terminal : bool
        Whether a terminal state's value counts as any other's (some older programs did so); by default it is 0.
    tensor_step : TensorStep, optional
        None is the unmodified algorithm; with a step it is the paper's T-version.
    seed : int or SeedSequence, optional
        Agent j draws from its child j. None takes a fresh seed.
    bins : int, sequence, ...
        How observations that are a Box are cut into bins: a number for every dimension, or for each dimension a number
        or the edges between its bins. Of a PettingZoo environment's agents, that for all or by agent.
    policy : Policy, optional
        How actions are chosen: see :mod:`tuckerl.training.policies`.
    compiled : "auto" or bool
        Whether an environment whose transition table can be extracted is played from it, in compiled code ("auto", the
        default), or every step is taken in Python (False); True is refused where it cannot be extracted.

    Raises
    ------
    ParameterError, ParameterTypeError, UnknownNameError
        If a parameter is out of its range, of the wrong type or not a known name.
    ProblemError
        If `env` is no problem that this learner can play.

    Notes
    -----
    A learner of one's own sets `state_type`, registers its kernels under it with
    :func:`~tuckerl.training.algorithm.register_algorithm` and overrides, where it needs to: `declare_state`,
    `constants`, `algorithm_schedules`, `default_policy`. It keeps each parameter of its constructor as an attribute of
    the same name, which is how parameters are saved. When one is assigned, the constructor is run again, and copies and
    files are made by it: what is learned belongs in declared arrays, as other attributes are then set anew.
    :func:`tuckerl.testing.check_learner` checks it.
    """

    state_type: ClassVar[type]
    """The NamedTuple that the algorithm's kernels are registered under, of declared arrays, schedules and constants."""

    reads_agents: ClassVar[Agents] = Agents.INDEPENDENT
    """What it makes of a PettingZoo environment, a table for each agent or one joint table."""

    team_reward: str = "mean"
    """What a PettingZoo environment of a joint table pays."""

    def __init_subclass__(cls, **keywords: Any) -> None:
        super().__init_subclass__(**keywords)
        base = next((kind for kind in cls.__mro__[1:] if "__signature__" in vars(kind)), Learner)
        own = signature(cls.__init__)
        own = own.replace(parameters=list(own.parameters.values())[1:])  # without self
        cls.__signature__ = merged_signature(own, signature(base))  # type: ignore[attr-defined]  # for help()
        cls.__doc__ = with_parameters(vars(cls).get("__doc__"), base.__doc__, cls.__signature__)  # type: ignore[attr-defined]  # as above

    def __new__(cls, *arguments: Any, **parameters: Any) -> Self:
        """Refuse unknown parameters, saying what may have been meant."""
        check_positions(cls, arguments)
        check_known(cls, parameters)
        learner = super().__new__(cls)
        learner._owner, learner._python_calls = Owner(), []  # before a subclass's own constructor, which may use them
        return learner

    def __init__(
        self,
        env: Environment,
        *,
        alpha: float | Schedule = 0.1,
        gamma: float = 0.95,
        epsilon: float | Schedule | None = None,
        epsilon_decay: float = 1.0,
        ties: Literal["random", "first"] = "random",
        initial_q: float | ArrayLike = 0.0,
        n_agents: int = 1,
        bootstrap_terminal: bool = False,
        tensor_step: TensorStep | None = None,
        seed: Seed = None,
        bins: Any = None,
        policy: Policy | None = None,
        compiled: Literal["auto"] | bool = "auto",
    ) -> None:
        check_registered(type(self))
        self._alpha_schedule = check_alpha(alpha)
        self.alpha = as_number(alpha)
        self.gamma = check_real("gamma", gamma, 0.0, 1.0)
        self.epsilon_decay = check_real("epsilon_decay", epsilon_decay, 0.0, 1.0)
        chosen = check_policy(policy, epsilon, self.epsilon_decay)
        self.epsilon: float | Schedule | None = getattr(chosen, "epsilon", None) if policy is None else None
        self.policy = policy
        self.ties = check_name("ties", ties, ("random", "first"))
        n_agents = check_int("n_agents", n_agents, 1)
        self.bootstrap_terminal = check_flag("bootstrap_terminal", bootstrap_terminal)
        self.tensor_step = check_step(type(self).__name__, tensor_step, self.why_no_weights(), self.why_no_sharing())
        self.seed_sequence = seed_sequence(seed)
        self.compiled = check_compiled(compiled)
        options = {"bins": bins, "compiled": self.compiled, "team_reward": self.team_reward}
        self.problem: Problem = as_problem(env, self.adapter_options(options))
        self.n_agents = self.problem.n_tables(n_agents)
        shape = (self.problem.n_states, self.problem.n_actions)
        check_equal_spaces(self.problem, self.tensor_step)
        self._acting_policy = self.adapt_policy(self.default_policy(chosen) if policy is None else chosen)
        own = self.declare_state()
        if not hasattr(self, "_state"):  # there is room for what there is
            declarations = (*own, *self._acting_policy.declare_state())
            parts = learner_parts(self.problem, self.n_agents, self.tensor_step, declarations)
            check_memory(type(self).__name__, parts)
        self.initial_q = check_initial_q(initial_q, shape)
        self._target_policy = self._acting_policy.target() or Greedy()
        rules = Rules(
            {"alpha": self._alpha_schedule, **self.algorithm_schedules()},
            self._acting_policy,
            own,
            Settings(self.gamma, self.gamma if self.bootstrap_terminal else 0.0, self.ties == "random"),
        )
        if hasattr(self, "_state"):  # a parameter was assigned
            self._state.go_on_by(rules)
        else:
            self._state = self._new_state(rules)
            self._prediction_rng = np.random.default_rng(child(self.seed_sequence, _PREDICTION_STREAM))
        self._check_policies()

    def _check_policies(self) -> None:
        """Refuse policies whose kernels nobody has registered."""
        for policy in (self._acting_policy, self._target_policy):
            arrays = policy.arrays(np.zeros(len(policy.schedules())), self._state.declared[0])
            check_policy_registered(policy, arrays)

    def _new_state(self, rules: Rules) -> TrainingState:
        n_worlds = 1 if self.problem.shares_world else self.n_agents
        return TrainingState(
            [self.problem.world() for _ in range(n_worlds)],
            self.initial_q,
            n_agents=self.n_agents,
            tensor_step=self.tensor_step,
            rules=rules,
            max_episode_steps=self.problem.max_episode_steps,
            keeps_maxima=self.state_type in KEEP_MAXIMA and self.problem.is_compiled,  # Python may change masks
            sequence=self.seed_sequence,
            check_declared=self.check_declared,
        )

    # What a learner's author overrides.

    def declare_state(self) -> tuple[Declaration, ...]:
        """Return the arrays that the algorithm keeps for each agent besides its Q-table.

        The fields of `state_type` have their names (without what stands before a dot).
        """
        return ()

    def check_declared(self, declared: Mapping[str, Any]) -> None:  # most learners need none
        """Refuse what a file holds of one agent under `declare_state`, by name, if it contradicts itself.

        Types, shapes and `bounds` are as declared. Whatever this raises, such as a
        :class:`~tuckerl.errors.SavedFileError`, the file is refused. Kernels write and read without asking whether an
        index exists, so nothing that they use as one may come from a file unchecked.
        """

    def constants(self) -> dict[str, Any]:
        """Return the fields of `state_type` that stay the same while a kernel runs."""
        return {}

    def algorithm_schedules(self) -> dict[str, Schedule]:
        """Return the algorithm's own numbers that may follow a schedule, by name.

        Kernels find their values in the field `scheduled` of `state_type`, in this order.
        """
        return {}

    def why_no_weights(self) -> str | None:
        """Return why a tensor step's weights mean nothing here, as where no step size is: a part of a sentence."""
        return None

    def why_no_sharing(self) -> str | None:
        """Return why shared tables mean nothing here, as where they follow from a model: a part of a sentence."""
        return None

    def default_policy(self, policy: Policy) -> Policy:
        """Return how actions are chosen where the user gives no policy.

        Parameters
        ----------
        policy : EpsilonGreedy
            The one that the parameter `epsilon` stands for.
        """
        return policy

    def adapt_policy(self, policy: Policy) -> Policy:
        """Return how a policy acts in this algorithm: itself, unless the algorithm knows better."""
        return policy

    @classmethod
    def adapter_options(cls, parameters: Mapping[str, Any]) -> AdapterOptions:
        """Return how a learner with these parameters reads its environment."""
        return AdapterOptions(cls.reads_agents, parameters.get("bins"), parameters.get("compiled", "auto"))

    def call_from_kernels(self, function: Callable[[int], int]) -> PythonCall:
        """Return a Python function in a form that the algorithm's kernels can call.

        An error in it ends learning as an error in an environment does: it is raised by `learn`.
        """
        call = PythonCall(function)
        self._python_calls.append(call)
        return call

    def algorithm_state(self, declared: Mapping[str, Any], scheduled: FloatArray) -> Any:
        """Return what the algorithm's kernels read of one agent, a `state_type`.

        Parameters
        ----------
        declared : mapping
            The agent's declared arrays by name.
        scheduled : (number of the algorithm's schedules,) float64
            Their values in the present episode.
        """
        fields = {name.rpartition(".")[2]: value for name, value in declared.items()} | self.constants()
        fields["scheduled"] = scheduled
        wanted: tuple[str, ...] = self.state_type._fields  # type: ignore[attr-defined]  # it is a NamedTuple
        missing = [name for name in wanted if name not in fields]
        if missing:
            raise LearnerError(
                f"{self.state_type.__name__} has a field {missing[0]!r} that {type(self).__name__} does not give it: "
                f"declare it in declare_state, or return it from constants"
            )
        return self.state_type(**{name: fields[name] for name in wanted})

    # What its users call.

    @answering_habits
    def learn(
        self,
        episodes: int | None = None,
        *,
        steps: int | None = None,
        callbacks: Sequence[CallbackLike] = (),
        progress: bool = False,
    ) -> Self:
        """Play and learn more episodes with every agent.

        Learning 50 and then 50 equals learning 100, to the last bit. A run whose tables are not finite any more stops
        there, with a :class:`~tuckerl.errors.DivergenceWarning`; see `diverged_at`.

        Ctrl-C waits up to a second for the end of an episode, and then breaks it off; pressed twice, at once, also in
        an environment's function that does not return. What an episode has changed that is broken off, by Ctrl-C or an
        error, is undone, and the next call plays it again: to the same bits as if nothing had been, unless an
        environment remembers more of it than its generator.

        Parameters
        ----------
        episodes : int, optional
            How many; or ...
        steps : int, optional
            ... stop after the episode in which the first agent has done so many more steps; where agents share one
            world, the world.
        callbacks : sequence of Callback or callable
            Called at the end of every window of episodes. A callable takes the learner; if it returns False, learning
            ends.
        progress : bool
            Whether to show a progress bar on a terminal.

        Raises
        ------
        ParameterError, ParameterTypeError
            If neither or both of `episodes` and `steps` are given, or one is not a whole number of at least 1.
        SimulatorError, EnvironmentFaultError
            If a simulator or an environment does something impossible. What was learned before is kept.
        """
        with self._owner.learning():
            Trainer(self, self._state, self._python_calls, self._owner).learn(
                episodes, steps, callbacks, progress=progress
            )
        if self.diverged_at is not None:
            warn(_DIVERGED.format(self.diverged_at), DivergenceWarning)
        return self

    @answering_habits
    def predict(
        self,
        observation: Any,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool | None = None,
        *,
        action_masks: Any = None,
    ) -> tuple[Any, None]:
        """Return agent 0's action for an observation or a batch of them, and None, as Stable-Baselines3 does.

        Observations and actions are the environment's own; for a problem of this library they are numbers. Of a
        PettingZoo environment's agents they are dicts by agent; of a team that plays the joint transition table of a
        problem of this library, numbers of joint states and of joint actions.

        Parameters
        ----------
        observation
        state, episode_start
            Ignored: there is no hidden state. They are here for programs that call any Stable-Baselines3 policy.
        deterministic : bool, optional
            None plays what is learned: the greedy action, the lowest on ties, or a draw from the learner's own
            distribution if it has one. True gives the most probable action of that, False draws from the policy with
            its present exploration.
        action_masks : optional
            Where actions may be taken, (A,) or, of a batch, (batch, A), as sb3-contrib has it; of a PettingZoo
            environment's agents by agent. A mask that the observation carries is obeyed without; where both are there,
            both hold. Without either, the masks that were seen in these states while learning hold.

        Raises
        ------
        ParameterError, ParameterTypeError, ObservationError
            If an observation is none of the environment's, or a mask none of its actions, or no action may be taken.
        """
        self._owner.check_thread("predict()")
        predictor = self._predictor(self._state.q, self._state.declared)
        return predictor.predict(observation, check_deterministic(deterministic), action_masks), None

    @answering_habits
    def evaluate(
        self,
        episodes: int = 100,
        *,
        env: Environment | None = None,
        deterministic: bool | None = None,
        render: bool = False,
        seed: Seed = None,
    ) -> Evaluation:
        """Play episodes apart from learning, which goes on as if they had not been.

        The policy is `predict`'s, under the environment's masks. By default the environment is a copy, and every call
        draws from the same stream, so that two calls without learning between them agree, unless `seed` gives another
        one. Without a time limit, episodes are cut off after 100,000 steps.

        Parameters
        ----------
        episodes : int
        env : optional
            Where to play instead: an altered environment, or one that is recorded or rendered, as the constructor takes
            it, with the spaces of the learned one. It is stepped in Python; an instance is the one that is stepped, is
            given a seed at its first reset, and stays open: close it to finish a recording.
        deterministic : bool, optional
            As of `predict`.
        render : bool
            Whether to show each step: in a window, ``render_mode="human"``, of an environment that is known by its id;
            else `env`, which must have a render mode. Where that is another than "human", ``env.render()`` is called
            after each reset and step.
        seed : int or SeedSequence, optional
            Default: the learner's own. The streams are others than those that a learner of the same seed learns from.

        Returns
        -------
        Evaluation
            The returns and steps of all episodes and agents, and the mean return with its interval.

        Raises
        ------
        ParameterError, ParameterTypeError
            If a parameter is impossible, `env` has other spaces, or there is nothing to be shown.
        ProblemError
            If the environment cannot be copied.
        EnvironmentFaultError
            If an environment raises an error or returns something impossible.
        """
        options = self.adapter_options({"bins": None, "compiled": False, "team_reward": self.team_reward})
        problem = judged_in(self.problem, env, options, render=check_flag("render", render))
        return self._evaluate(self._state.q, self._state.declared, episodes, seed, deterministic, problem)

    def evaluate_saved(self, path: str | PathLike[str], episodes: int = 100, *, seed: Seed = None) -> Evaluation | None:
        """Evaluate the tables that an earlier part of this run has saved; None where `path` holds nothing of it.

        Raises
        ------
        ProblemError
            If the environment cannot be copied.
        """
        path = check_path("path", path)
        try:
            saved = persistence.read(path)
            is_ours = saved.is_of(type(self))
            is_ours &= bool((saved.seed.generate_state(4) == self.seed_sequence.generate_state(4)).all())
            if not is_ours:
                return None
            with reading(path):
                held = persistence.read_state(saved, self._state)
        except (SavedFileError, SavedFileMissingError):
            return None
        if held.history["steps"].shape[1] > self.episodes:
            return None
        return self._evaluate(held.q, held.declared, episodes, seed)

    def _evaluate(
        self,
        q: FloatArray,
        declared: Sequence[Mapping[str, Any]],
        episodes: int,
        seed: Seed,
        deterministic: bool | None = None,
        problem: Problem | None = None,
    ) -> Evaluation:
        with self._owner.at_rest("evaluate()"):
            return evaluate(
                self._predictor(q, declared),
                self.problem if problem is None else problem,
                check_int("episodes", episodes, 1),
                child(self.seed_sequence if seed is None else seed_sequence(seed), _EVALUATION_STREAM),
                deterministic=check_deterministic(deterministic),
            )

    def _predictor(self, q: FloatArray, declared: Sequence[Mapping[str, Any]]) -> Predictor:
        state = self._state
        return Predictor(
            self.problem,
            self._acting_policy,
            self._target_policy,
            q,
            declared,
            state.action_masks,
            self.episodes,
            random_ties=self.ties == "random",
            rng=self._prediction_rng,
        )

    def save(self, path: str | PathLike[str]) -> None:
        """Write everything that is needed to go on, to the last bit, into one file (no pickle).

        Raises
        ------
        OutputError
            If it cannot be written.
        """
        with self._owner.at_rest("save()"):
            persistence.save(self, self._state, self._prediction_rng, check_path("path", path))

    @classmethod
    def load(
        cls,
        path: str | PathLike[str],
        *,
        env: Environment | None = None,
        tensor_step: TensorStep | None = None,
        **parameters: Any,
    ) -> Self:
        """Return the learner that `save` wrote.

        Parameters that are given replace the saved ones, as if they had been assigned to it: ``load(path, alpha=0.01)``
        goes on with a smaller learning rate.

        What is code is in no file: `env` is needed where the problem is a simulator or an environment that is stepped
        in Python and was not named by its id, `tensor_step` where the saved one used functions of the user's own; both
        as they were.

        Raises
        ------
        SavedFileError
            If the file is truncated, damaged, of another kind or learner, or of a newer version.
        ParameterError
            If `env` or `tensor_step` is not the one that it was saved with, or a parameter is one that cannot change.
        FileNotFoundError
            If there is none.
        """
        saved = persistence.read(check_path("path", path))
        return persistence.load(cls, saved, env=env, tensor_step=tensor_step, changes=parameters)

    def restore(self, saved: persistence.SavedLearner) -> None:
        """Go on from the content of a learner's file, which `load` has read."""
        with self._owner.learning("restore()"):
            persistence.restore(saved, self._state, self._prediction_rng)

    # What it shows, besides what `Learned` has.

    @property
    def parameters(self) -> dict[str, Any]:
        """What its constructor was given or took by default, but for arrays, the seed and the tensor step."""
        return persistence.plain_parameters(self)

    def __repr__(self) -> str:
        parameters = self.parameters | {"tensor_step": self.tensor_step}
        listed = ", ".join(f"{name}={value!r}" for name, value in parameters.items())
        return f"{type(self).__name__}({self.problem}, {listed}): {self.episodes} episodes"


_own = signature(Learner.__init__)
Learner.__signature__ = _own.replace(parameters=list(_own.parameters.values())[1:])  # type: ignore[attr-defined]  # for help()
