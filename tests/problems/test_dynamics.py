"""How kernels play: the transitions of the arrays, at the frequencies of the probabilities."""

import numpy as np
import pytest
from scipy.stats import chisquare

from tuckerl.problems.dynamics import reset, step
from tuckerl.problems.maze import sutton_maze
from tuckerl.problems.mdp import TabularMDP
from tuckerl.problems.mdp_kernels import draw_outcome
from tuckerl.rng import seed_sequence, stream, uniform
from tuckerl.types import Stream

DRAWS = 6000


@pytest.fixture
def rng() -> Stream:
    return stream(seed_sequence(0))


def three_outcomes() -> TabularMDP:
    """From state 0, action 0 is certain and action 1 leads to states 0, 1, 2 (and never 3) with 0.1, 0.2, 0.7."""
    next_state = np.tile(np.arange(4), (4, 2, 1))
    probability = np.zeros((4, 2, 4))
    probability[:, 0, 3] = 1
    probability[:, 1, :3] = 0.1, 0.2, 0.7
    start = [0.3, 0, 0.6, 0.1]
    return TabularMDP(next_state, next_state * 10.0, next_state == 2, probability, start=start)


def test_a_maze_is_walked_by_its_transitions(rng: Stream) -> None:
    maze = sutton_maze()
    mdp = maze.to_mdp()
    before = rng.copy()
    assert reset(mdp.world().arrays, rng) == maze.state((2, 0))
    for state in range(maze.n_states):
        for action in range(4):
            outcome = state * 4 + action
            expected = tuple(a[outcome] for a in (mdp.arrays.next_state, mdp.arrays.reward, mdp.arrays.terminated))
            assert step(mdp.arrays, state, action, rng) == expected
    assert np.array_equal(rng, before), "what is certain must not use up random numbers"
    assert step(mdp.arrays, maze.state((2, 0)), 3, rng) == (maze.state((2, 1)), -1.0, False)
    assert step(mdp.arrays, maze.state((2, 1)), 3, rng) == (maze.state((2, 1)), -1.0, False)
    assert step(mdp.arrays, maze.state((1, 8)), 0, rng) == (maze.state((0, 8)), 0.0, True)


def test_outcomes_come_at_their_frequencies(rng: Stream) -> None:
    arrays = three_outcomes().world().arrays
    seen = [step(arrays, 0, 1, rng) for _ in range(DRAWS)]
    counts = np.bincount([state for state, _, _ in seen], minlength=4)
    assert counts[3] == 0
    assert chisquare(counts[:3], DRAWS * np.array([0.1, 0.2, 0.7])).pvalue > 0.01
    assert all(reward == state * 10 and terminated == (state == 2) for state, reward, terminated in seen)


@pytest.mark.parametrize("count", [1, 2, 32, 33, 1000])
def test_of_many_outcomes_the_same_is_drawn_as_of_few(count: int, rng: Stream) -> None:
    p = np.random.default_rng(count).dirichlet(np.full(count, 0.1))  # some are so small that they add nothing
    cumulative = np.concatenate([[0.9, 1.0], np.cumsum(p), [1.0]])  # between those of other pairs
    for _ in range(300):
        expected = min(int(np.searchsorted(np.cumsum(p), uniform(rng.copy()), side="right")), count - 1)
        assert draw_outcome(cumulative, 2, 2 + count, rng) == 2 + expected


def test_a_certain_outcome_among_random_ones_needs_no_draw(rng: Stream) -> None:
    before = rng.copy()
    assert step(three_outcomes().world().arrays, 1, 0, rng) == (3, 30.0, False)
    assert np.array_equal(rng, before)


def test_starts_come_at_their_frequencies(rng: Stream) -> None:
    arrays = three_outcomes().world().arrays
    counts = np.bincount([reset(arrays, rng) for _ in range(DRAWS)], minlength=4)
    assert counts[1] == 0
    assert chisquare(counts[[0, 2, 3]], DRAWS * np.array([0.3, 0.6, 0.1])).pvalue > 0.01


def test_probabilities_that_fall_short_of_1_by_rounding_stay_inside_their_pair(rng: Stream) -> None:
    arrays = three_outcomes().world().arrays
    short = arrays._replace(cumulative=arrays.cumulative * 1e-300, start_cumulative=arrays.start_cumulative * 1e-300)
    assert step(short, 0, 1, rng)[0] == 2
    assert reset(short, rng) == 3


def test_equal_streams_play_equally_and_others_differ() -> None:
    arrays = three_outcomes().world().arrays
    played = []
    for seed in (1, 1, 2):
        rng = stream(seed_sequence(seed))
        played.append([step(arrays, 0, 1, rng)[0] for _ in range(50)])
    assert played[0] == played[1]
    assert played[0] != played[2]
