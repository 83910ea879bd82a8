"""Greedy episodes apart from learning, and what they say of a policy."""

import warnings
from typing import Any, NamedTuple

import numpy as np

from tuckerl._jit import kernel
from tuckerl.adapters.pettingzoo_problem import PettingZooProblem
from tuckerl.adapters.python_world import STEP_CAP
from tuckerl.adapters.resolve import Problem
from tuckerl.errors import StepCapWarning
from tuckerl.generalization.change_log import empty_log
from tuckerl.interrupts import interrupts_held_back
from tuckerl.intervals import bca_interval
from tuckerl.problems.worlds import World
from tuckerl.rng import child, stream
from tuckerl.training.agent_arrays import Agent, Record, Settings, Transition
from tuckerl.training.loop import algorithm, play, play_together
from tuckerl.training.policies import greedy
from tuckerl.types import FloatArray, IntArray

CAPPED = (
    "an episode was cut off after {} steps, as the environment has no time limit: set one, for example with "
    "gymnasium.make(..., max_episode_steps=...)"
)
_BOOTSTRAP = 2**32 - 1  # the child of the seed for the interval
_ALL = np.iinfo(np.int64).max


class GreedyMethod(NamedTuple):
    """A policy that is followed and learns nothing."""


@kernel
def first(method: GreedyMethod, agent: Agent, state: int, epsilon: float) -> int:
    """Choose the greedy action."""
    return greedy(agent, state)


@kernel
def turn(method: GreedyMethod, agent: Agent, seen: Transition, epsilon: float) -> int:
    """Choose the next greedy action."""
    return 0 if seen.ended else greedy(agent, seen.next_state)


algorithm(GreedyMethod, first=first, turn=turn)


class Evaluation(NamedTuple):
    """What E greedy episodes were like; `mean` is of their returns, over the agents of an environment, too."""

    returns: FloatArray  # (E, N) undiscounted; N is 1, or the number of a PettingZoo environment's agents
    steps: IntArray  # (E, N)
    mean: float
    low: float  # of the 95 % interval of the mean, BCa bootstrap over episodes
    high: float

    def __repr__(self) -> str:
        """Say what it comes to; the arrays would fill the screen."""
        return f"Evaluation(mean={self.mean:g}, low={self.low:g}, high={self.high:g}, episodes={len(self.returns)})"


def evaluate(problem: Problem, q: FloatArray, episodes: int, sequence: np.random.SeedSequence) -> Evaluation:
    """Play greedy episodes by the first of (N, S, A) tables, or by all where each belongs to an agent of its own.

    Ties go to the lowest action. `sequence` decides all draws.
    """
    if problem.max_episode_steps is None:  # a greedy policy may go round in circles for ever
        problem = problem.with_time_limit(STEP_CAP)
        problem.is_capped = True  # a new one: the learner's own stays as it is
    together = isinstance(problem, PettingZooProblem)
    tables = q if together else q[:1]
    world = problem.world()
    world.seed(child(sequence, 0))
    steps = np.zeros((len(tables), episodes), dtype=np.int64)
    returns = np.zeros((len(tables), episodes))
    agents = tuple(
        _follower(table, world, place, steps[place], returns[place], stream(child(sequence, place)))
        for place, table in enumerate(tables)
    )
    arrays: Any = world.arrays
    try:
        with interrupts_held_back(bearable=0):
            if together:
                play_together(arrays, agents)
            else:
                play(arrays, agents[0])
            world.raise_pending()
    finally:
        world.close()
    if problem.is_capped and steps.max() == problem.max_episode_steps:
        warnings.warn(
            CAPPED.format(problem.max_episode_steps), StepCapWarning, stacklevel=4
        )  # the caller of a learner's evaluate()
    values = returns.mean(axis=0)
    low, high = mean_interval(values, np.random.default_rng(child(sequence, _BOOTSTRAP)))
    return Evaluation(returns.T.copy(), steps.T.copy(), float(values.mean()), low, high)


def _follower(table: FloatArray, world: World, place: int, steps: IntArray, returns: FloatArray, rng: Any) -> Agent:
    n_episodes, n_actions = steps.size, table.shape[1]
    zeros = np.zeros(n_episodes)
    return Agent(
        method=GreedyMethod(),
        q=table,
        weights=np.ones(n_actions),
        step_sizes=np.zeros(n_actions),
        action_mask=world.action_masks[place],
        settings=Settings(gamma=1.0, terminal_discount=0.0, random_ties=False),
        log=empty_log(table.shape[0], n_actions, 0),
        record=Record(steps, returns, np.zeros(1, dtype=np.int64), zeros, zeros, _ALL),
        rng=rng,
    )


def mean_interval(values: FloatArray, rng: np.random.Generator) -> tuple[float, float]:
    """Return the 95 % interval of a mean, by the BCa bootstrap; NaN for a single value."""
    if values.size > 1 and np.ptp(values) == 0:  # every resample gives the same mean, for which BCa is not defined
        return float(values[0]), float(values[0])
    return bca_interval((values,), np.mean, rng)
