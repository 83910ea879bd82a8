"""Where a step of Q-learning spends its time: each part alone, on the states of its paths, and the whole.

Alone, a part need not wait for the one before it: the states are known. The parts' sum is what has to be done. What the
whole takes beyond it is waiting: the next state is known only when a row was read, its largest entry found and the
outcome looked up, and none of these can begin before the one before it has ended.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.steps import SIZES, random_table
from benchmarks.timing import Row, replaced, seconds
from tuckerl import QLearning
from tuckerl._jit import kernel
from tuckerl.learners.q_learning import QLearningState, update
from tuckerl.problems.dynamics import step
from tuckerl.rng import uniform
from tuckerl.training import trainer
from tuckerl.training.agent_arrays import AgentArrays, Transition, must_stop, record_state
from tuckerl.training.algorithm import act
from tuckerl.training.loop import play
from tuckerl.training.policies.greedy import GreedyArrays
from tuckerl.types import StateArray

EPISODES, PATHS, REPEATS = 1000, 100, 100


def rows() -> list[Row]:
    """Time the parts at the three sizes."""
    return [row for size in SIZES for row in _rows(*size)]


def _rows(n_states: int, n_actions: int) -> list[Row]:
    learner = QLearning(random_table(n_states, n_actions), alpha=0.1, gamma=0.95, epsilon=0.1, seed=0).learn(EPISODES)
    paths = [learner.learn(1).trajectories[0][:-1] for _ in range(PATHS)]
    (world, agent), states = _arguments(learner), np.tile(np.concatenate(paths), EPISODES // PATHS).astype(np.uint32)
    actions, next_states, n = learner.q[0].argmax(axis=1)[states].astype(np.uint32), np.roll(states, -1), states.size
    greedy = agent._replace(policy=GreedyArrays())
    parts: dict[str, Callable[[], object]] = {
        "a random number": lambda: _draw(agent, n),
        "the greedy action": lambda: _choose(greedy, states),
        "the outcome": lambda: _look_up(world, agent, states, actions),
        "the update": lambda: _update(agent, states, actions, next_states),
        "path and Ctrl-C": lambda: _record(agent, states),
        "the whole step": lambda: learner.learn(EPISODES),
    }
    size = f"{n_states} x {n_actions}"
    return [Row(f"{size}: {part}", "step", _least(work) / n, "-", None, None) for part, work in parts.items()]


def _arguments(learner: QLearning) -> tuple[Any, AgentArrays]:
    """Return what the loop is called with."""
    seen: list[Any] = []

    def spy(*arguments: Any) -> int:
        seen.append(arguments)
        return play(*arguments)

    with replaced(trainer, "play", spy):
        learner.learn(1)
    world, agent = seen[0]
    return world, agent


def _least(work: Callable[[], object]) -> float:
    work()
    return min(seconds(work) for _ in range(REPEATS))


@kernel
def _draw(agent: AgentArrays, n: int) -> float:
    """Draw n numbers."""
    total = 0.0
    for _ in range(n):
        total += uniform(agent.rng)
    return total


@kernel
def _choose(agent: AgentArrays, states: StateArray) -> int:
    """Choose an action in each of `states` (n,)."""
    total = 0
    for state in states:
        total += act(agent.algorithm, agent, state)
    return total


@kernel
def _look_up(world: Any, agent: AgentArrays, states: StateArray, actions: StateArray) -> float:
    """Take a step from each of `states` (n,) by `actions` (n,)."""
    total = 0.0
    for i in range(states.size):
        next_state, reward, terminated = step(world, states[i], actions[i], agent.rng)
        total += next_state + reward + terminated
    return total


@kernel
def _update(agent: AgentArrays, states: StateArray, actions: StateArray, next_states: StateArray) -> bool:
    """Learn from n steps, (n,) each."""
    finite = True
    for i in range(states.size):
        transition = Transition(states[i], actions[i], 0.5, 0.95, next_states[i], False)
        finite &= update(QLearningState(), agent, transition, 0)
    return finite


@kernel
def _record(agent: AgentArrays, states: StateArray) -> int:
    """Keep `states` (n,) as a path, and ask at each step whether to stop."""
    total = 0
    for i in range(states.size):
        record_state(agent.record, 0, i % 500, states[i])
        total += must_stop(agent.record, i)
    return total
