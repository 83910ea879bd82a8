"""A run is a pure function of its specification and its seed."""

from pathlib import Path

import numpy as np
import pytest

from tests.learners.worlds import random_mdp
from tuckerl import DynaH, QLearning, Sarsa, SarsaLambda, TeamQ, TensorStep
from tuckerl.rng import child
from tuckerl.training.learner import Learner

PROBLEM = random_mdp(21, n_outcomes=2)
STEP = TensorStep(every=5, ranks=(2, 2, 1, 1), weights="permuted", share="random", floor=0.1)
LEARNERS = [QLearning, DynaH, Sarsa, SarsaLambda, TeamQ]


@pytest.mark.parametrize("learner", LEARNERS)
@pytest.mark.parametrize("step", [None, STEP])
def test_same_seed_same_bits_and_other_seed_other_bits(learner: type[Learner], step: TensorStep | None) -> None:
    first, again, other = (learner(PROBLEM, seed=seed, n_agents=2, tensor_step=step).learn(20) for seed in (4, 4, 5))
    np.testing.assert_array_equal(first.q, again.q)
    np.testing.assert_array_equal(first.steps, again.steps)
    np.testing.assert_array_equal(first.action_weights, again.action_weights)
    assert not np.array_equal(first.q, other.q)
    assert not np.array_equal(first.steps, other.steps)


@pytest.mark.parametrize("learner", LEARNERS)
def test_agents_differ_and_do_not_depend_on_how_many_there_are(learner: type[Learner]) -> None:
    three = learner(PROBLEM, seed=4, n_agents=3).learn(20)
    one = learner(PROBLEM, seed=4).learn(20)
    np.testing.assert_array_equal(three.q[0], one.q[0])
    np.testing.assert_array_equal(three.steps[:, :1], one.steps)
    assert not np.array_equal(three.q[0], three.q[1])
    assert not np.array_equal(three.q[1], three.q[2])


@pytest.mark.parametrize("learner", LEARNERS)
def test_a_seed_may_be_a_sequence(learner: type[Learner]) -> None:
    whole = learner(PROBLEM, seed=4).learn(5)
    sequence = np.random.SeedSequence(4)
    sequence.spawn(2)  # what was spawned before does not count
    np.testing.assert_array_equal(whole.q, learner(PROBLEM, seed=sequence).learn(5).q)
    assert not np.array_equal(whole.q, learner(PROBLEM, seed=child(sequence, 0)).learn(5).q)


@pytest.mark.parametrize("learner", LEARNERS)
def test_a_seed_that_is_a_child_goes_on_through_a_file(learner: type[Learner], tmp_path: Path) -> None:
    seed = child(np.random.SeedSequence(4), 2, 1)

    def fresh() -> Learner:
        return learner(PROBLEM, seed=seed, n_agents=2, tensor_step=STEP)

    whole = fresh().learn(20)
    fresh().learn(8).save(tmp_path / "learner")
    again = learner.load(tmp_path / "learner").learn(12)
    assert again.seed_sequence.spawn_key == (2, 1)
    np.testing.assert_array_equal(again.q, whole.q)
    np.testing.assert_array_equal(again.action_weights, whole.action_weights)  # each step draws from a child of its own
    np.testing.assert_array_equal(again.evaluate(5).returns, whole.evaluate(5).returns)


def test_no_seed_is_a_fresh_one() -> None:
    learners = [QLearning(PROBLEM).learn(10) for _ in range(4)]
    assert len({learner.seed_sequence.entropy for learner in learners}) == 4
    assert any(not np.array_equal(learner.q, learners[0].q) for learner in learners)  # two may learn the same by chance


def test_the_global_generator_is_left_alone() -> None:
    before = np.random.get_state()[1].copy()  # type: ignore[index]  # noqa: NPY002
    QLearning(PROBLEM, tensor_step=STEP, seed=1).learn(10).predict(0, deterministic=False)
    np.testing.assert_array_equal(before, np.random.get_state()[1])  # type: ignore[index]  # noqa: NPY002
