"""The kernels against their twin in Python and against the same loop in C."""

import numpy as np
from tests.learners.worlds import world_of
from tests.reference.dyna_h import DynaHLearner
from tests.reference.rng import Stream

from benchmarks import c_peer
from benchmarks.timing import Row, compare, seconds
from tuckerl.learners.dyna_h import DynaH
from tuckerl.learners.q_learning import QLearning
from tuckerl.problems.maze import random_maze
from tuckerl.problems.mdp import TabularMDP
from tuckerl.training.learner import Learner

EPISODES, TWIN_EPISODES = 1000, 3


def rows() -> list[Row]:
    """Time an update of Q-learning and of Dyna-H on the paper's maze number 0."""
    problem = random_maze(seed=0).to_mdp()
    return [row for n in (0, 10) for row in (_row_against_c(problem, n), _twin_row(problem, n))]


def against_c() -> list[Row]:
    """Time the same against C alone."""
    problem = random_maze(seed=0).to_mdp()
    return [_row_against_c(problem, planning_steps) for planning_steps in (0, 10)]


def _learner(problem: TabularMDP, planning_steps: int) -> Learner:
    if planning_steps == 0:
        return QLearning(problem, seed=0)
    return DynaH(problem, planning_steps=planning_steps, seed=0)


def _name(planning_steps: int) -> str:
    return f"Dyna-H, {planning_steps} planning steps" if planning_steps else "Q-learning"


def _row_against_c(problem: TabularMDP, planning_steps: int) -> Row:
    what, played = _name(planning_steps), _learner(problem, planning_steps).learn(EPISODES)
    updates = (1 + planning_steps) * float(played.steps.sum())

    def ours() -> None:
        _learner(problem, planning_steps).learn(EPISODES)

    in_c = c_peer.dyna_h(problem, planning_steps, EPISODES, seed=0)
    if in_c is None:
        return Row(what, "update", seconds(ours) / updates, c_peer.NO_COMPILER, None, None)
    q, steps = in_c()
    if not (np.array_equal(q, played.q[0]) and np.array_equal(steps, played.steps[:, 0])):
        raise RuntimeError("the loop in C does something else than the kernel: its time says nothing")
    return compare(what, "update", ours, "the same loop in C", in_c, units=updates, repeats=15)


def _twin_row(problem: TabularMDP, planning_steps: int) -> Row:
    updates = (1 + planning_steps) * float(_learner(problem, planning_steps).learn(EPISODES).steps.sum())
    heuristic = np.zeros(problem.n_states) if problem.heuristic is None else problem.heuristic
    world, zeros = world_of(problem), np.zeros((problem.n_states, problem.n_actions))

    def twin() -> int:
        learner = DynaHLearner(
            *(world, Stream(0, 0), 0.1, 0.95, 0.1, 1.0, "random", zeros),
            heuristic=heuristic,
            planning_steps=planning_steps,
            search_control="trajectory",
        )
        return sum(learner.episode(np.ones(problem.n_actions))[0] for _ in range(TWIN_EPISODES))

    return compare(
        _name(planning_steps),
        "update",
        lambda: _learner(problem, planning_steps).learn(EPISODES),
        "its twin in pure Python",
        twin,
        units=updates,
        peer_units=(1 + planning_steps) * twin(),
        repeats=3,
    )
