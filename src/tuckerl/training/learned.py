"""What a learner shows of what it has learned."""

from abc import ABC
from typing import Any

import numpy as np

from tuckerl.adapters.making import make_environment
from tuckerl.checks import check_name
from tuckerl.generalization.change_log import ChangeLog
from tuckerl.generalization.loadings import Loadings
from tuckerl.generalization.step_history import TensorStepHistory, empty_history
from tuckerl.generalization.tensor_step import TensorStep
from tuckerl.problems.problem import Problem
from tuckerl.training.history import EpisodeHistory
from tuckerl.training.policies.policy import Policy
from tuckerl.training.trainer import WINDOW
from tuckerl.training.training_state import TrainingState
from tuckerl.types import BoolArray, FloatArray, IntArray


class Learned(ABC):
    """The part of every learner that only looks: at its tables, its history, its tensor step."""

    problem: Problem
    """What is played: arrays, compiled functions, or an environment that is stepped in Python."""

    n_agents: int
    """Length of the agent axis: the number of agents, or of a PettingZoo environment's agents."""

    tensor_step: TensorStep | None
    seed_sequence: np.random.SeedSequence
    _state: TrainingState
    _acting_policy: Policy

    @property
    def env(self) -> Any:
        """The environment: the one that the first agent steps, without the time limit around it.

        Where a problem is played in compiled code, one that is made by the environment's id; without an id, the problem
        itself. Resetting or stepping the one that is learned in disturbs the episode that it plays next.
        """
        held = vars(self)
        if "_env" not in held:
            problem: Any = self.problem
            if problem.is_compiled:
                held["_env"] = problem if problem.id is None else make_environment(problem.id)
            else:
                held["_env"] = problem.env
        return held["_env"]

    @property
    def episodes(self) -> int:
        """Number of episodes finished."""
        return self._state.history.episodes

    @property
    def history(self) -> EpisodeHistory:
        """Steps and returns of all episodes, not to be changed: `steps` and `returns` without a copy."""
        return self._state.history

    @property
    def steps(self) -> IntArray:
        """Steps of each episode, (episodes, n_agents)."""
        return self._state.history.steps.T.copy()

    @property
    def returns(self) -> FloatArray:
        """Undiscounted return of each episode, (episodes, n_agents)."""
        return self._state.history.returns.T.copy()

    @property
    def first_agent_steps(self) -> int:
        """Steps of the first agent in all its episodes, or of the world that all share: what `learn` counts."""
        return self._state.history.first_agent_steps

    @property
    def q(self) -> FloatArray:
        """A copy of the tables, (n_agents, S, A)."""
        return self._state.q.copy()

    @property
    def declared(self) -> tuple[dict[str, Any], ...]:
        """What each agent keeps under the names of `declare_state` and of the policy's; not copies."""
        return self._state.declared

    @property
    def acting_policy(self) -> Policy:
        """The policy by which actions are chosen while learning."""
        return self._acting_policy

    @property
    def change_logs(self) -> tuple[ChangeLog, ...]:
        """Which rows of each agent's table changed in the present window, as the kernels recorded it."""
        return self._state.logs

    @property
    def action_mask(self) -> BoolArray | None:
        """Where an action may be taken, as far as is known, (n_agents, S, A); None where all may."""
        tables = self._state.action_masks
        return np.stack(tables) if all(table.size for table in tables) else None

    @property
    def action_weights(self) -> FloatArray:
        """The learning-rate weight of each action, (A,); ones before the first window ends."""
        return self._state.weights.copy()

    @property
    def tensor_step_history(self) -> TensorStepHistory:
        """The weights and the chosen agent of every window; empty without a tensor step."""
        step = self._state.tensor_step
        return empty_history(self.problem.n_actions) if step is None else step.history

    @property
    def loadings(self) -> Loadings | None:
        """The factors of the latest window that the tensor step has decomposed; None before that."""
        return None if self._state.tensor_step is None else self._state.tensor_step.loadings

    @property
    def tensor_step_seconds(self) -> float:
        """Processor time that the tensor step has taken since this learner was made or loaded."""
        return 0.0 if self._state.tensor_step is None else self._state.tensor_step.seconds

    @property
    def window(self) -> int:
        """Episodes from one tensor step to the next; without one, from one call of callbacks to the next."""
        return WINDOW if self.tensor_step is None else self.tensor_step.interval

    @property
    def diverged_at(self) -> int | None:
        """The episode in which a table was not finite any more, where learning stopped; None if there is none."""
        return self._state.diverged_at

    @property
    def is_saveable(self) -> bool:
        """Whether learning can go on: no table has diverged."""
        return self._state.is_saveable

    @property
    def in_sync(self) -> bool:
        """Whether all agents are at one episode, and the tensor step of the latest window is done."""
        return self._state.in_sync

    @property
    def trajectories(self) -> tuple[IntArray, ...]:
        """Each agent's states in its latest episode, a million at most; none before all have finished one."""
        state = self._state
        if self.episodes == 0 or not (state.history.in_sync and state.is_saveable):
            return tuple(np.zeros(0, dtype=np.int64) for _ in range(self.n_agents))
        last = state.history.steps[:, -1]
        return tuple(state.latest_trajectory(agent)[: n + 1].copy() for agent, n in enumerate(last))

    @property
    def scheduled_names(self) -> tuple[str, ...]:
        """The numbers that may follow a schedule: "alpha", then the algorithm's own and the policy's."""
        return self._state.schedules.names

    def scheduled(self, name: str) -> FloatArray:
        """Return the values of "alpha", "epsilon" or another scheduled number in all episodes so far, (episodes,).

        They are what was in force in each episode, whatever was assigned since; NaN where nothing of this name was.

        Raises
        ------
        UnknownNameError
            If this learner has no such number.
        """
        recorded = self._state.schedules.recorded(self.episodes)
        return recorded[check_name("scheduled number", name, recorded)]

    def to_frame(self) -> Any:
        """Return the history as a Polars frame: a row for each agent and episode, with its steps and return.

        Its ``.to_pandas()`` needs pandas and pyarrow, which this library does not: ``pip install pandas pyarrow``.
        """
        import polars as pl  # takes longer to import than all the rest

        history = self._state.history
        agent, episode = np.meshgrid(np.arange(self.n_agents), np.arange(self.episodes), indexing="ij")
        columns = {"agent": agent, "episode": episode, "steps": history.steps, "return": history.returns}
        return pl.DataFrame({name: values.ravel() for name, values in columns.items()})
