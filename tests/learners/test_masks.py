"""What a mask forbids is never done, never learned and never promised: kernels against their slow twins."""

from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.spaces import Discrete
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.learners.worlds import dyna_twin, random_mdp, sarsa_lambda_twin, sarsa_twin, team_twin, twin
from tuckerl import DynaH, Greedy, QLearning, Sarsa, SarsaLambda, TabularMDP, TeamQ, TensorStep
from tuckerl.errors import ProblemError
from tuckerl.types import BoolArray

TWINS: dict[Any, Any] = {
    QLearning: twin,
    Sarsa: sarsa_twin,
    SarsaLambda: sarsa_lambda_twin,
    DynaH: dyna_twin,
    TeamQ: team_twin,
}
EPISODES = 8


def masks(seed: int, n_states: int, sizes: tuple[int, ...]) -> BoolArray:
    """Where actions may be taken: for each agent at random, but never none."""
    rng = np.random.default_rng(seed)
    allowed = np.ones((n_states, 1), dtype=np.bool_)
    for size in sizes:
        own = rng.random((n_states, size)) < 0.6
        own[np.arange(n_states), rng.integers(size, size=n_states)] = True
        allowed = (allowed[:, :, None] & own[:, None, :]).reshape(n_states, -1)
    return allowed


def masked_mdp(seed: int, *, n_states: int = 9, sizes: tuple[int, ...] = (4,), **parameters: Any) -> TabularMDP:
    n_actions = int(np.prod(sizes))
    plain = random_mdp(seed, n_states=n_states, n_actions=n_actions, action_sizes=sizes, **parameters)
    arrays = plain.arrays._replace(action_mask=masks(seed, n_states, sizes))
    return TabularMDP.from_arrays(arrays, n_states, plain.heuristic, plain.action_sizes)


def compare(made: Any, problem: TabularMDP, **parameters: Any) -> None:
    learner = made(problem, seed=3, n_agents=2, **parameters).learn(EPISODES)
    for agent in range(2):
        slow = TWINS[made](problem, seed=3, agent=agent, **parameters)
        played = [slow.episode(np.ones(problem.n_actions)) for _ in range(EPISODES)]
        assert learner.steps[:, agent].tolist() == [steps for steps, _ in played]
        assert learner.trajectories[agent].tolist() == slow.trajectory
        np.testing.assert_allclose(learner.q[agent], slow.q, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("made", TWINS, ids=lambda made: made.__name__)
def test_forced_actions_equal_the_twins(made: Any, seed: int) -> None:
    problem = masked_mdp(seed, n_outcomes=1 + seed % 2, random_start=seed > 1)
    compare(made, problem, alpha=0.3, epsilon=1.0)


@pytest.mark.parametrize("ties", ["first", "random"])
@pytest.mark.parametrize("made", TWINS, ids=lambda made: made.__name__)
def test_greedy_actions_equal_the_twins(made: Any, ties: str) -> None:
    # Rewards of 0 and 1 and halves of them: no sum rounds.
    rng = np.random.default_rng(7)
    problem = TabularMDP(
        rng.integers(5, size=(5, 4)),
        rng.integers(2, size=(5, 4)).astype(np.float64),
        rng.random((5, 4)) < 0.2,
        max_episode_steps=5,
        heuristic=np.arange(5.0),
        action_mask=masks(1, 5, (4,)),
    )
    extra = {"planning_steps": 1} if made is DynaH else {"lambda_": 0.5} if made in (SarsaLambda, TeamQ) else {}
    compare(made, problem, alpha=0.5, gamma=0.5, epsilon=0.5, ties=ties, **extra)


@pytest.mark.parametrize("exploration", ["independent", "joint"])
@pytest.mark.parametrize("cut", [False, True])
def test_teams_with_masks_equal_the_twin(exploration: str, cut: bool) -> None:
    for seed in range(3):
        problem = masked_mdp(seed, sizes=(3, 2, 2))
        compare(TeamQ, problem, alpha=0.1, epsilon=1.0, exploration=exploration, cut_traces=cut, trace="accumulating")


@settings(deadline=None, max_examples=40)
@given(
    seed=st.integers(0, 2**32 - 1),
    made=st.sampled_from(list(TWINS)),
    epsilon=st.sampled_from([0.0, 0.3, 1.0]),
    ties=st.sampled_from(["first", "random"]),
    with_step=st.booleans(),
)
def test_a_forbidden_action_is_never_taken(seed: int, made: Any, epsilon: float, ties: Any, with_step: bool) -> None:
    # What is never taken keeps its first value; a share of tables may carry it to another agent, where it is the same.
    problem = masked_mdp(seed, sizes=(2, 3) if made is TeamQ else (4,), n_outcomes=1 + seed % 2)
    step = TensorStep(every=3, ranks=(2, 2, 2, 1), weights="constant", share="best") if with_step else None
    learner = made(problem, seed=seed, epsilon=epsilon, ties=ties, n_agents=2, initial_q=1 / 3, tensor_step=step)
    learner.learn(7)
    forbidden = ~problem.arrays.action_mask
    assert (learner.q[:, forbidden] == 1 / 3).all()
    greedy = learner.predict(np.arange(9))[0]
    drawn = [learner.predict(np.arange(9), deterministic=False)[0] for _ in range(20)]
    for actions in [greedy, *drawn]:
        assert not forbidden[np.arange(9), actions].any()


def test_forbidden_values_promise_nothing() -> None:
    # From state 0 to 1, where the action that is worth 50 may not be taken; the one that may be is worth 2.
    problem = TabularMDP(
        [[1, 1], [1, 1]],
        [[0.0, 0.0], [0.0, 0.0]],
        [[False, False], [True, True]],
        action_mask=[[True, True], [False, True]],
        max_episode_steps=1,
    )
    first = [[0.0, 0.0], [50.0, 2.0]]
    for made in (QLearning, Sarsa, SarsaLambda, TeamQ):
        learner = made(problem, alpha=1.0, gamma=0.5, initial_q=first, epsilon=0.0, ties="first", seed=0).learn(1)
        assert learner.q[0, 0, 0] == 1.0
    assert QLearning(problem, initial_q=first, seed=0).predict(1)[0] == 1


@pytest.mark.parametrize("made", TWINS, ids=lambda made: made.__name__)
def test_where_nothing_is_allowed_all_is(made: Any) -> None:
    free = random_mdp(5)
    same = TabularMDP(
        free.arrays.next_state.reshape(7, 3),
        free.arrays.reward.reshape(7, 3),
        free.arrays.terminated.reshape(7, 3),
        heuristic=free.heuristic,
        max_episode_steps=60,
        action_mask=np.zeros((7, 3), dtype=np.bool_),
    )
    np.testing.assert_array_equal(made(same, seed=1).learn(5).q, made(free, seed=1).learn(5).q)


def test_greedy_episodes_keep_to_the_mask() -> None:
    problem = masked_mdp(2)
    pay = np.where(problem.arrays.action_mask.ravel(), 1.0, -1e6)
    outcomes = problem.arrays.outcomes.copy()
    outcomes["reward"] = pay
    arrays = problem.arrays._replace(outcomes=outcomes)
    learner = QLearning(TabularMDP.from_arrays(arrays, 9), seed=0, initial_q=0.0).learn(1)
    evaluation = learner.evaluate(10)
    assert (evaluation.returns == evaluation.steps).all()


def test_agents_who_explore_need_masks_of_their_own() -> None:
    # Both may do 0 or 1, but not the same: who explores cannot know.
    mask = [[False, True, True, False]]
    problem = TabularMDP([[0] * 4], [[0.0] * 4], [[True] * 4], action_sizes=(2, 2), action_mask=mask)
    with pytest.raises(ProblemError, match=r"independent of each other .* in state 0 .* use exploration='joint'"):
        TeamQ(problem, seed=0)
    team = TeamQ(problem, seed=0, exploration="joint", epsilon=1.0, initial_q=5.0).learn(50)
    assert (team.q[0, 0] == 5.0).tolist() == [True, False, False, True]


class Waiting(gymnasium.Env[np.int64, np.int64]):
    """0 -> 1 -> 1 -> end; the first time in 1 there is no choice."""

    observation_space, action_space = Discrete(2), Discrete(2)

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[np.int64, dict[str, Any]]:
        """Begin in 0."""
        super().reset(seed=seed)
        self.n_steps = 0
        return np.int64(0), self._info()

    def step(self, action: np.int64) -> tuple[np.int64, float, bool, bool, dict[str, Any]]:
        """Go on, for a reward of 1."""
        self.n_steps += 1
        return np.int64(1), 1.0, self.n_steps == 3, False, self._info()

    def _info(self) -> dict[str, Any]:
        return {"action_mask": np.array([self.n_steps != 1, True])}


def test_what_was_greedy_when_it_was_chosen_cuts_no_traces() -> None:
    table = np.array([[0.0, 0.0], [1.0, 0.0]])
    cut, uncut = (
        TeamQ(Waiting(), policy=Greedy(), cut_traces=cuts, lambda_=1.0, alpha=0.5, initial_q=table, seed=0).learn(1)
        for cuts in (True, False)
    )
    np.testing.assert_array_equal(cut.q, uncut.q)
