"""How long learning goes on, and what is told of it afterwards."""

from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest

from tests.adapters.parallel_worlds import Leaving
from tests.learners.worlds import random_mdp
from tests.training.counting import countings
from tests.training.test_resume import LEARNERS, assert_same, make
from tuckerl import QLearning, TensorStep
from tuckerl.errors import ParameterError, ParameterTypeError
from tuckerl.training.learner import Learner

PROBLEM = random_mdp(91, n_outcomes=2)
STEPS = {"no step": None, "paper": TensorStep(every=5, ranks=(4, 2, 3, 1))}


# The first agent's episodes take 1, 2, 3, 1, 2, 3, ... steps: 1, 3, 6, 7, 9, 12, 13, ... in all.
@pytest.mark.parametrize(
    ("steps", "episodes"), [(1, 1), (2, 2), (3, 2), (4, 3), (6, 3), (7, 4), (8, 5), (12, 6), (13, 7)]
)
@pytest.mark.parametrize("n_agents", [1, 3])
def test_it_ends_with_the_episode_that_reaches_the_steps(steps: int, episodes: int, n_agents: int) -> None:
    learner = QLearning(countings(), n_agents=n_agents, seed=1).learn(steps=steps)
    assert learner.episodes == episodes
    assert learner.first_agent_steps == learner.steps[:, 0].sum() >= steps > learner.steps[:-1, 0].sum()


def test_steps_are_counted_anew_in_every_call() -> None:
    learner = QLearning(countings(), seed=1)
    assert learner.learn(steps=2).episodes == 2  # 3 steps
    assert learner.learn(steps=4).episodes == 4  # 3 + 1 more
    assert learner.learn(steps=1).episodes == 5
    assert learner.learn(1).episodes == 6
    assert learner.learn(steps=10**30, callbacks=[lambda _: False]).episodes == 100  # stopped at the first window


def test_of_agents_in_one_world_the_worlds_steps_count() -> None:
    # They leave after 1, 2 and 3 steps.
    learner = QLearning(Leaving(), seed=1).learn(steps=5)
    assert learner.steps.tolist() == [[1, 2, 3]] * 2
    assert learner.first_agent_steps == 6


def test_steps_end_where_the_first_agent_is_never_there(tmp_path: Path) -> None:
    class Late(Leaving):
        def reset(self, seed: Any = None, options: Any = None) -> Any:
            observations, infos = super().reset(seed, options)
            self.agents = self.agents[1:]
            return {agent: observations[agent] for agent in self.agents}, infos

    learner = QLearning(Late(), seed=1).learn(steps=7)
    assert learner.steps.tolist() == [[0, 2, 3]] * 3
    learner.save(tmp_path / "agent")
    assert QLearning.load(tmp_path / "agent", env=Late()).first_agent_steps == 9


@pytest.mark.parametrize("n_agents", [1, 3])
@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize("learner", LEARNERS)
def test_steps_or_as_many_episodes_are_the_same(learner: type[Learner], step: str, n_agents: int) -> None:
    by_steps = make(learner, STEPS[step], n_agents).learn(steps=120).learn(steps=170)
    first = int(np.searchsorted(np.cumsum(by_steps.steps[:, 0]), 120)) + 1
    after = by_steps.steps[first:, 0]
    assert after[:-1].sum() < 170 <= after.sum()
    assert_same(by_steps, make(learner, STEPS[step], n_agents).learn(by_steps.episodes))


@pytest.mark.parametrize("step", STEPS)
def test_steps_go_on_through_a_file(step: str, tmp_path: Path) -> None:
    learner = make(QLearning, STEPS[step], 2).learn(steps=100)
    learner.save(tmp_path / "agent")
    again = QLearning.load(tmp_path / "agent")
    assert again.first_agent_steps == learner.first_agent_steps == learner.steps[:, 0].sum()
    assert_same(again.learn(steps=100), learner.learn(steps=100))


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({}, ParameterError, r"either episodes or steps; got None and None"),
        ({"episodes": 1, "steps": 1}, ParameterError, r"either episodes or steps; got 1 and 1"),
        ({"steps": 0}, ParameterError, "steps must be a whole number of at least 1; got 0"),
        ({"steps": 2.0}, ParameterTypeError, "steps must be .* got 2.0 of type float"),
        ({"episodes": 0}, ParameterError, "episodes must be a whole number of at least 1; got 0"),
        ({"episodes": True}, ParameterTypeError, "episodes must be .* got True"),
    ],
)
def test_goals_are_checked(arguments: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        QLearning(PROBLEM, seed=1).learn(**arguments)


def test_the_frame_by_hand() -> None:
    frame = QLearning(countings(), n_agents=2, seed=1).learn(4).to_frame()
    expected = pl.DataFrame(
        {
            "agent": [0, 0, 0, 0, 1, 1, 1, 1],
            "episode": [0, 1, 2, 3, 0, 1, 2, 3],
            "steps": [1, 2, 3, 1, 1, 2, 3, 1],
            "return": [0.0, 1.0, 2.0, 3.0, 10.0, 11.0, 12.0, 13.0],
        }
    )
    assert frame.equals(expected)
    assert frame.schema == expected.schema


def test_the_frame_of_nothing_is_empty() -> None:
    frame = QLearning(PROBLEM, seed=1).to_frame()
    assert frame.columns == ["agent", "episode", "steps", "return"]
    assert frame.height == 0
    assert frame.dtypes == [pl.Int64, pl.Int64, pl.Int64, pl.Float64]


def test_the_frame_is_the_history() -> None:
    learner = QLearning(PROBLEM, n_agents=3, seed=1).learn(11)
    frame = learner.to_frame()
    np.testing.assert_array_equal(frame["steps"].to_numpy().reshape(3, 11).T, learner.steps)
    np.testing.assert_array_equal(frame["return"].to_numpy().reshape(3, 11).T, learner.returns)
    learner.learn(1)
    assert frame.height == 33  # a copy
