"""Episodes apart from learning, and what they say of a policy."""

import math
from typing import Any, NamedTuple

import numpy as np

from tuckerl.errors import StepCapWarning, warn
from tuckerl.interrupts import interrupts_held_back
from tuckerl.intervals import bca_interval, is_constant
from tuckerl.memory import check_memory
from tuckerl.problems.problem import Problem
from tuckerl.rng import child, stream
from tuckerl.training.agent_arrays import EpisodeRecord
from tuckerl.training.guards import raise_fault
from tuckerl.training.kernel_calls import KernelCall
from tuckerl.training.loop import play, play_together
from tuckerl.training.memory_account import evaluation_parts
from tuckerl.training.prediction import Predictor
from tuckerl.training.row_maxima import maxima_of, room_for_maxima
from tuckerl.types import FloatArray, IntArray

CAPPED = (
    "an episode was cut off after {} steps, as the environment has no time limit: set one, for example by "
    "max_episode_steps"
)
_BOOTSTRAP = 2**32 - 1  # the child of the seed for the interval
_ALL = np.iinfo(np.int64).max


class Evaluation(NamedTuple):
    """What E episodes were like; `mean` is of their returns, over the agents of an environment, too."""

    returns: FloatArray  # (E, N) undiscounted; N is 1, or the number of a PettingZoo environment's agents
    steps: IntArray  # (E, N)
    mean: float
    low: float  # of the 95 % interval of the mean, BCa bootstrap over episodes
    high: float

    def __repr__(self) -> str:
        """Say what it comes to; the arrays would fill the screen."""
        return f"Evaluation(mean={self.mean:g}, low={self.low:g}, high={self.high:g}, episodes={len(self.returns)})"


def evaluate(
    predictor: Predictor,
    problem: Problem,
    episodes: int,
    sequence: np.random.SeedSequence,
    *,
    deterministic: bool | None = None,
) -> Evaluation:
    """Play episodes by the first agent's table, or by all agents' where these share one world.

    Parameters
    ----------
    predictor : Predictor
    problem : Problem
        Where they are played: the predictor's own, or another of the same spaces.
    episodes : int
    sequence : SeedSequence
        Decides all draws.
    deterministic : bool, optional
        As of :meth:`tuckerl.training.learner.Learner.predict`.
    """
    n_agents = len(predictor.q) if problem.shares_world else 1
    check_memory("evaluating", evaluation_parts(problem, n_agents, episodes))
    world = problem.world()
    world.seed(child(sequence, 0))
    steps, returns = np.zeros((n_agents, episodes), dtype=np.int64), np.zeros((n_agents, episodes))
    scheduled = np.zeros((episodes, 1))
    call = KernelCall(calls_python=not problem.is_compiled, seconds=math.inf)
    sizes = problem.n_states, problem.n_actions
    rows = [room_for_maxima(*sizes) if problem.is_compiled else None for _ in range(n_agents)]
    agents = tuple(
        predictor.agent(
            i,
            deterministic,
            action_mask=world.action_masks[i],
            maxima=maxima_of(rows[i], call.number),
            record=EpisodeRecord(
                steps[i], returns[i], np.zeros((2, 1), np.int64), scheduled, _ALL, 0, call.stop, call.listen
            ),
            rng=stream(child(sequence, i)),
        )
        for i in range(n_agents)
    )
    arrays: Any = world.arrays
    try:
        with interrupts_held_back(bearable=0):
            if problem.shares_world:
                call.run(play_together, arrays, agents)
            else:
                call.run(play, arrays, agents[0])
            world.raise_pending()
            raise_fault("evaluate", arrays, agents)
    finally:
        world.close()
    if problem.is_capped and steps.max() == problem.max_episode_steps:
        warn(CAPPED.format(problem.max_episode_steps), StepCapWarning)
    values = returns.mean(axis=0)
    low, high = mean_interval(values, np.random.default_rng(child(sequence, _BOOTSTRAP)))
    return Evaluation(returns.T.copy(), steps.T.copy(), float(values.mean()), low, high)


def mean_interval(values: FloatArray, rng: np.random.Generator) -> tuple[float, float]:
    """Return the 95 % interval of a mean, by the BCa bootstrap; NaN for a single value."""
    if is_constant(values, float(np.abs(values).max())):  # every resample gives the same mean
        return float(values.mean()), float(values.mean())
    return bca_interval((values,), np.asarray, rng)
