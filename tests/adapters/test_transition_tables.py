"""Transition tables lifted from Gymnasium's environments: nothing added, nothing lost, and learned to the optimum."""

import math
from collections import defaultdict
from itertools import accumulate
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.envs.toy_text import CliffWalkingEnv, FrozenLakeEnv, TaxiEnv
from gymnasium.spaces import Discrete, MultiDiscrete
from scipy.stats import chisquare

from tests.reference.value_iteration import Model, action_values, model_of, optimal_values, policy_values, regret
from tuckerl import QLearning, TabularMDP
from tuckerl.adapters.transition_tables import extract_transition_table
from tuckerl.errors import ProblemError
from tuckerl.problems.dynamics import reset, step
from tuckerl.rng import seed_sequence, stream, uniform

CERTAIN: list[tuple[str, dict[str, Any]]] = [
    ("FrozenLake-v1", {"is_slippery": False}),
    ("FrozenLake8x8-v1", {"is_slippery": False}),
    ("FrozenLake-v1", {"success_rate": 1.0}),
    ("CliffWalking-v1", {}),
    ("Taxi-v4", {}),
]
RANDOM: list[tuple[str, dict[str, Any]]] = [
    ("FrozenLake-v1", {}),
    ("FrozenLake8x8-v1", {}),
    ("FrozenLake-v1", {"desc": ["SSF", "FHG"], "success_rate": 0.7, "reward_schedule": (5, -1, -0.25)}),
    ("CliffWalkingSlippery-v1", {}),
    ("Taxi-v4", {"is_rainy": True}),
]


def made(name: str, **settings: Any) -> Any:
    return gymnasium.make(name, **settings).unwrapped


def extracted(env: Any) -> TabularMDP:
    mdp = extract_transition_table(env)
    assert mdp is not None
    return mdp


def summed_outcomes(mdp: TabularMDP, s: int, a: int) -> list[tuple[float, int, float, bool]]:
    """The outcomes of a pair as kernels read them: (summed probability, s', r, terminated)."""
    arrays, pair = mdp.arrays, s * mdp.n_actions + a
    if not arrays.offsets.size:
        return [(1.0, int(arrays.next_state[pair]), float(arrays.reward[pair]), bool(arrays.terminated[pair]))]
    return [
        (float(arrays.cumulative[k]), int(arrays.next_state[k]), float(arrays.reward[k]), bool(arrays.terminated[k]))
        for k in range(arrays.offsets[pair], arrays.offsets[pair + 1])
    ]


@pytest.mark.parametrize(("name", "settings"), CERTAIN + RANDOM)
def test_every_outcome_and_every_start_is_the_environments(name: str, settings: dict[str, Any]) -> None:
    env = made(name, **settings)
    mdp = extracted(env)
    assert (mdp.n_states, mdp.n_actions) == (env.observation_space.n, env.action_space.n)
    assert mdp.max_episode_steps is None
    assert (mdp.arrays.offsets.size == 0) == ((name, settings) in CERTAIN)
    for s in range(mdp.n_states):
        for a in range(mdp.n_actions):
            told = [(p, int(there), float(r), bool(end)) for p, there, r, end in env.P[s][a] if p > 0]
            sums = list(accumulate(p for p, *_ in told))
            expected = [(total, *outcome[1:]) for total, outcome in zip(sums, told, strict=True)]
            if all(outcome[1:] == told[0][1:] for outcome in told):
                expected = [(1.0, *told[0][1:])]
            assert summed_outcomes(mdp, s, a) == expected
    starts = np.flatnonzero(env.initial_state_distrib)
    assert mdp.arrays.start_state.tolist() == starts.tolist()
    assert mdp.arrays.start_cumulative.tolist() == list(accumulate(env.initial_state_distrib[starts].tolist()))


@pytest.mark.parametrize(("name", "settings"), CERTAIN)
def test_without_chance_environment_and_table_play_alike(name: str, settings: dict[str, Any]) -> None:
    env = made(name, **settings)
    arrays, words = extracted(env).world().arrays, stream(seed_sequence(0))
    actions = np.random.default_rng(0).integers(env.action_space.n, size=2000)
    state, _ = env.reset(seed=0)
    for action in actions.tolist():
        seen, reward, terminated, truncated, _ = env.step(action)
        assert (seen, reward, terminated, truncated) == (*step(arrays, state, action, words), False)
        state = env.reset()[0] if terminated else seen


class Draw:
    """A generator that gives Gymnasium one chosen number."""

    def __init__(self, u: float) -> None:
        self.u = u

    def random(self) -> float:
        return self.u


@pytest.mark.parametrize(("name", "settings"), CERTAIN + RANDOM)
def test_the_same_draw_has_the_same_outcome(name: str, settings: dict[str, Any]) -> None:
    env = made(name, **settings)
    env.reset(seed=0)
    mdp, words = extracted(env), stream(seed_sequence(1))
    for _ in range(100):
        env.np_random = Draw(uniform(words.copy()))
        assert env.reset()[0] == reset(mdp.world().arrays, words)
        words[0] += np.uint64(1)  # where there is one start, nothing was drawn
    draws = 3 if mdp.n_states > 100 else 20
    for s, a in np.ndindex(mdp.n_states, mdp.n_actions):
        for _ in range(draws):
            env.s, env.np_random = s, Draw(uniform(words.copy()))
            assert env.step(a)[:3] == step(mdp.arrays, s, a, words)
            words[0] += np.uint64(1)


@pytest.mark.parametrize(
    ("name", "settings", "s", "a", "expected"),
    [
        ("FrozenLake-v1", {}, 0, 1, {0: 1 / 3, 1: 1 / 3, 4: 1 / 3}),
        ("FrozenLake-v1", {}, 0, 0, {0: 2 / 3, 4: 1 / 3}),
        ("FrozenLake-v1", {"success_rate": 0.8}, 14, 2, {10: 0.1, 14: 0.1, 15: 0.8}),
        ("CliffWalkingSlippery-v1", {}, 25, 2, {24: 1 / 3, 26: 1 / 3, 36: 1 / 3}),
        ("Taxi-v4", {"is_rainy": True}, 241, 1, {141: 0.8, 221: 0.1, 261: 0.1}),
    ],
)
def test_next_states_come_at_their_frequencies(
    name: str, settings: dict[str, Any], s: int, a: int, expected: dict[int, float]
) -> None:
    arrays, words, draws = extracted(made(name, **settings)).world().arrays, stream(seed_sequence(2)), 6000
    states = [step(arrays, s, a, words)[0] for _ in range(draws)]
    assert set(states) == set(expected)
    counts = [states.count(state) for state in expected]
    assert chisquare(counts, [draws * p for p in expected.values()]).pvalue > 0.01


def test_what_lies_on_a_grid_has_its_layout() -> None:
    assert extracted(made("FrozenLake8x8-v1")).layout == (8, 8)
    assert extracted(FrozenLakeEnv(desc=["SFF", "FHG"])).layout == (2, 3)
    assert extracted(CliffWalkingEnv()).layout == (4, 12)
    assert extracted(TaxiEnv()).layout is None
    cliff = CliffWalkingEnv()
    cliff.shape = (5, 12)  # of some subclass that means another thing by it
    assert extracted(cliff).layout is None


def test_a_taxis_masks_are_those_it_reports() -> None:
    env = made("Taxi-v4", is_rainy=True)
    mdp = extracted(env)
    env.reset(seed=0)
    for s in range(500):  # among them those in which an episode ends
        env.s = s
        _, _, _, _, info = env.step(0)
        assert mdp.arrays.action_mask[env.s].tolist() == [bool(allowed) for allowed in info["action_mask"]]
        assert mdp.arrays.action_mask[s].tolist() == [bool(allowed) for allowed in env.action_mask(s)]
    assert extracted(FrozenLakeEnv()).arrays.action_mask.size == 0


SWAP: dict[int, Any] = {
    0: {0: [(1.0, 0, 0.0, False)], 1: [(0.5, 1, 2.0, False), (0.5, 0, -1.0, True)]},
    1: {0: [(1.0, 1, 0.0, True)], 1: [(1.0, 0, 1.0, False)]},
}


class Told(gymnasium.Env[Any, Any]):
    """A user's environment that is nothing but its table."""

    def __init__(self, P: Any = SWAP, starts: Any = (0.25, 0.75), states: Any = 2, actions: Any = 2) -> None:
        self.P, self.initial_state_distrib = P, starts
        self.observation_space = Discrete(states) if isinstance(states, int) else states
        self.action_space = Discrete(actions) if isinstance(actions, int) else actions

    def __str__(self) -> str:
        return "Told"


def changed(s: int, a: int, outcomes: Any) -> dict[int, Any]:
    return {**SWAP, s: {**SWAP[s], a: outcomes}}


def test_a_users_own_table() -> None:
    mdp = extracted(Told())
    assert mdp.arrays.next_state.tolist() == [0, 1, 0, 1, 0]
    assert mdp.arrays.reward.tolist() == [0, 2, -1, 0, 1]
    assert mdp.arrays.terminated.tolist() == [False, False, True, True, False]
    assert mdp.arrays.offsets.tolist() == [0, 1, 3, 4, 5]
    assert mdp.arrays.cumulative.tolist() == [1, 0.5, 1, 1, 1]
    assert mdp.arrays.start_cumulative.tolist() == [0.25, 1]
    assert mdp.layout is None


def as_lists(P: dict[int, Any]) -> list[list[Any]]:
    return [list(row.values()) for row in P.values()]


def test_tables_of_lists_and_of_numpys_numbers_are_read_alike() -> None:
    numbers = [
        [
            [(np.float32(p), np.int64(s), np.float32(r), np.bool_(end)) for p, s, r, end in outcomes]
            for outcomes in row.values()
        ]
        for row in SWAP.values()
    ]
    objects = np.empty((2, 2), dtype=object)
    for s, a in np.ndindex(2, 2):
        objects[s, a] = [[p, there, int(r), int(end)] for p, there, r, end in SWAP[s][a]]
    rows = [{np.int64(a): outcomes for a, outcomes in SWAP[s].items()} for s in range(2)]
    expected = extracted(Told()).arrays
    for table in (as_lists(SWAP), numbers, objects, rows, tuple(map(tuple, as_lists(SWAP)))):
        read = extracted(Told(table)).arrays
        assert [np.asarray(part).tolist() for part in read] == [np.asarray(part).tolist() for part in expected]


def test_what_never_happens_may_be_anything_and_what_always_happens_needs_no_draw() -> None:
    never = (0.0, 99, math.nan, None)
    mdp = extracted(Told(changed(0, 1, [never, (0.25, 1, 3, False), never, (0.75, 1, 3.0, False)])))
    assert mdp.arrays.offsets.size == 0
    assert mdp.arrays.next_state.tolist() == [0, 1, 1, 0]
    assert mdp.arrays.reward.tolist() == [0, 3, 0, 1]


def test_equal_outcomes_apart_from_each_other_keep_their_places() -> None:
    back, on = (0.25, 0, 0.0, False), (0.5, 1, 0.0, False)
    mdp = extracted(Told(changed(0, 1, [back, on, back])))
    assert summed_outcomes(mdp, 0, 1) == [(0.25, 0, 0, False), (0.75, 1, 0, False), (1.0, 0, 0, False)]


def test_asking_for_a_missing_pair_does_not_make_it() -> None:
    growing: Any = defaultdict(lambda: defaultdict(list))
    growing[0][0] = [(1.0, 0, 0.0, True)]
    with pytest.raises(ProblemError, match=r"\(s, a\) = \(0, 1\)"):
        extract_transition_table(Told(growing))
    assert {s: list(row) for s, row in growing.items()} == {0: [0]}


def test_masks_of_a_users_environment() -> None:
    env: Any = Told()
    env.action_mask = lambda state: np.array([state == 0, True])
    assert extracted(env).arrays.action_mask.tolist() == [[True, True], [False, True]]
    env.action_mask = lambda state: [0, state]  # none in state 0: all
    assert extracted(env).arrays.action_mask.tolist() == [[True, True], [False, True]]
    env.action_mask = [[1, 1], [0, 1]]  # not asked by state: no mask of this kind
    assert extracted(env).arrays.action_mask.size == 0


class WindyLake(FrozenLakeEnv):
    def step(self, a: Any) -> Any:
        return super().step(a)  # type: ignore[no-untyped-call]  # Gymnasium's own has no types


class MovedCliff(CliffWalkingEnv):
    def reset(self, **options: Any) -> Any:
        return super().reset(**options)


class OtherLake(FrozenLakeEnv):
    """Whose table is its own and whose steps are Gymnasium's."""

    def __init__(self) -> None:
        super().__init__(is_slippery=False)
        self.P[0][0] = [(1.0, 15, 7, True)]


def without(attribute: str) -> Any:
    env = Told()
    delattr(env, attribute)
    return env


def with_attribute(env: Any, **attributes: Any) -> Any:
    for name, value in attributes.items():
        setattr(env, name, value)
    return env


@pytest.mark.parametrize(
    "env",
    [
        without("P"),
        without("initial_state_distrib"),
        without("observation_space"),
        without("action_space"),
        Told(starts=None),
        Told(states=Discrete(2, start=1)),
        Told(actions=Discrete(2, start=-1)),
        Told(states=MultiDiscrete([2])),
        Told(actions=MultiDiscrete([2])),
        Told({**SWAP, 2: SWAP[0]}),
        Told({**SWAP, 1: {**SWAP[1], 2: SWAP[0][0]}}),
        Told(states=1),
        TaxiEnv(fickle_passenger=True),
        WindyLake(),
        MovedCliff(),
        with_attribute(Told(), step=lambda a: None),
        with_attribute(TaxiEnv(), reset=lambda **_: None),
        with_attribute(Told(), action_mask=lambda: [1, 1]),
        gymnasium.make("Blackjack-v1").unwrapped,
        gymnasium.make("CartPole-v1").unwrapped,
    ],
    ids=lambda env: str(type(env).__name__),
)
def test_where_the_table_does_not_tell_all_there_is_none(env: Any) -> None:
    assert extract_transition_table(env) is None


def test_a_subclass_that_plays_by_its_own_table_is_lifted() -> None:
    assert summed_outcomes(extracted(OtherLake()), 0, 0) == [(1.0, 15, 7.0, True)]


GOOD = (1.0, 0, 0.0, False)


@pytest.mark.parametrize(
    ("P", "message"),
    [
        (
            {0: SWAP[0]},
            r"\(s, a\) = \(1, 0\) in P of Told must be a list; got nothing: correct it, or learn with",
        ),
        ({**SWAP, 1: {0: [GOOD]}}, r"\(s, a\) = \(1, 1\) in P of Told must be a list; got nothing"),
        ([[[GOOD], [GOOD]], [[GOOD]]], r"\(s, a\) = \(1, 1\) .* got nothing"),
        (3, r"\(s, a\) = \(0, 0\) .* got nothing"),
        (changed(0, 1, []), r"\(0, 1\) .* must be a list; got \[\]"),
        (changed(0, 1, 5), r"\(0, 1\) .* must be a list; got 5"),
        (changed(1, 0, [GOOD[:3]]), r"\(1, 0\) .* tuples \(probability, next state, .*; got \(1\.0, 0, 0\.0\)"),
        (changed(1, 0, GOOD), r"\(1, 0\) .* tuples \(probability, next state, .*; got 1\.0"),
        (changed(1, 0, [(0.5, *GOOD[1:])]), r"\(1, 0\) .* probabilities that sum to 1; theirs sum to 0\.5"),
        (changed(1, 0, [(-0.5, *GOOD[1:]), (1.5, *GOOD[1:])]), r"\(1, 0\) .* from 0 to 1; got -0\.5"),
        (changed(1, 0, [(1.5, *GOOD[1:])]), r"\(1, 0\) .* probabilities from 0 to 1; got 1\.5"),
        (changed(1, 0, [(math.nan, *GOOD[1:])]), r"\(1, 0\) .* probabilities from 0 to 1; got nan"),
        (changed(1, 0, [("1", *GOOD[1:])]), r"\(1, 0\) .* probabilities from 0 to 1; got '1'"),
        (changed(0, 0, [(1.0, 2, 0.0, False)]), r"\(0, 0\) .* must lead to states from 0 to 1; got 2"),
        (changed(0, 0, [(1.0, -1, 0.0, False)]), r"\(0, 0\) .* must lead to states from 0 to 1; got -1"),
        (changed(0, 0, [(1.0, 1.0, 0.0, False)]), r"\(0, 0\) .* must lead to states from 0 to 1; got 1\.0"),
        (changed(0, 0, [(1.0, False, 0.0, 0)]), r"\(0, 0\) .* must lead to states from 0 to 1; got False"),
        (changed(1, 1, [(1.0, 0, math.nan, False)]), r"\(1, 1\) .* must pay finite rewards; got nan"),
        (changed(1, 1, [(1.0, 0, -math.inf, False)]), r"\(1, 1\) .* must pay finite rewards; got -inf"),
        (changed(1, 1, [(1.0, 0, None, False)]), r"\(1, 1\) .* must pay finite rewards; got None"),
        (changed(1, 1, [(1.0, 0, 0.0, None)]), r"\(1, 1\) .* by True or False whether they terminate; got None"),
        (changed(1, 1, [(1.0, 0, 0.0, 2)]), r"\(1, 1\) .* by True or False whether they terminate; got 2"),
    ],
)
def test_malformed_tables_are_refused_by_the_pair(P: Any, message: str) -> None:
    with pytest.raises(ProblemError, match=message):
        extract_transition_table(Told(P))


@pytest.mark.parametrize(
    ("starts", "message"),
    [
        ([1.0], r"initial_state_distrib of Told must be 2 prob.* one for each state; got an array of shape \(1,\)"),
        (1.0, r"2 probabilities, one for each state; got an array of shape \(\)"),
        ([0.5, 0.6], r"at least 0 and sum to 1; got \[0\.5 0\.6\], their sum is 1\.1.* learn with compiled=False"),
        ([-1, 2], r"at least 0 and sum to 1"),
        ([math.nan, 1], r"at least 0 and sum to 1"),
        ([math.inf, -math.inf], r"at least 0 and sum to 1"),
        ({0: 1.0}, r"2 probabilities, one for each state; got an array of shape \(\)"),
        ([[0.5], [0.25, 0.25]], r"2 probabilities, one for each state: .* must be one array"),
    ],
)
def test_malformed_starts_are_refused(starts: Any, message: str) -> None:
    with pytest.raises(ProblemError, match=message):
        extract_transition_table(Told(starts=starts))


@pytest.mark.parametrize("dtype", [np.float16, np.float32])
def test_probabilities_that_sum_to_1_within_their_own_rounding_are_taken(dtype: type) -> None:
    third = dtype(1 / 3)
    assert abs(3 * float(third) - 1) > 1e-8
    mdp = extracted(Told(changed(0, 1, [(third, s, 0.0, False) for s in (0, 1, 0)]), starts=[third, 1 - third]))
    np.testing.assert_allclose(mdp.arrays.cumulative[1:4], [1 / 3, 2 / 3, 1.0], rtol=1e-15)
    assert mdp.arrays.start_cumulative[-1] == 1.0
    with pytest.raises(ProblemError, match=r"theirs sum to (1\.00|0\.99)"):  # nothing says that these were rounded so
        extracted(Told(changed(0, 1, [(float(third) + 1e-7, s, 0.0, False) for s in (0, 1, 0)])))


@pytest.mark.parametrize("mask", [[1], [[1, 1]], [1, 2], [0.5, 1.0], None, ["a", "b"]])
def test_malformed_masks_are_refused(mask: Any) -> None:
    env = with_attribute(Told(), action_mask=lambda state: mask if state else [1, 1])
    with pytest.raises(
        ProblemError, match=r"action_mask\(1\) of Told must be 2 numbers, 1 for .*: correct it, or learn"
    ):
        extract_transition_table(env)


def risky_chain(action_mask: Any = None) -> TabularMDP:
    """State 0 pays 1 for staying or leads on to state 1, which ends and pays 3, or as likely 8 as leads back."""
    probability: Any = [[[1, 0], [1, 0]], [[1, 0], [0.5, 0.5]]]
    return TabularMDP(
        [[[0, 0], [1, 1]], [[0, 0], [0, 0]]],
        [[[1, 1], [0, 0]], [[3, 3], [0, 8]]],
        [[[False] * 2, [False] * 2], [[True] * 2, [False, True]]],
        probability,
        start=[0.25, 0.75],
        action_mask=action_mask,
    )


def test_the_oracle_on_a_chain_solved_by_hand() -> None:
    # With gamma = 1/2: V(1) = 4 + V(0) / 4 and V(0) = V(1) / 2, so V(0) = 16/7; staying is worth 1 + 8/7 = 15/7.
    model = model_of(risky_chain())
    assert optimal_values(model, 0.5) == pytest.approx([16 / 7, 32 / 7], abs=1e-9)
    values = action_values(model, np.array([16 / 7, 32 / 7]), 0.5)
    assert values == pytest.approx(np.array([[15 / 7, 16 / 7], [3, 32 / 7]]), abs=1e-9)
    assert policy_values(model, np.array([1, 1]), 0.5) == pytest.approx([16 / 7, 32 / 7], abs=1e-9)
    assert policy_values(model, np.array([0, 1]), 0.5) == pytest.approx([2, 4.5], abs=1e-9)
    assert policy_values(model, np.array([1, 0]), 0.5) == pytest.approx([1.5, 3], abs=1e-9)
    # From the starts the optimum is 4, and [2, 3] is worth 2.75.
    assert regret(model, np.array([[0.0, 1.0], [0.0, 1.0]]), 0.5) == pytest.approx(0, abs=1e-9)
    assert regret(model, np.array([[1.0, 0.0], [1.0, 0.0]]), 0.5) == pytest.approx(1.25 / 4, abs=1e-9)


def test_the_oracle_takes_no_forbidden_action() -> None:
    model = model_of(risky_chain([[True, True], [True, False]]))
    assert optimal_values(model, 0.5) == pytest.approx([2, 3], abs=1e-9)
    assert regret(model, np.array([[1.0, 0.0], [0.0, 1.0]]), 0.5) == pytest.approx(0, abs=1e-9)


def test_the_oracle_counts_costs_as_shares_of_the_least() -> None:
    costs = Model(np.array([[-10.0, -11.0]]), np.zeros((1, 2, 1)), np.ones((1, 2), dtype=np.bool_), np.ones(1))
    assert regret(costs, np.array([[0.0, 1.0]]), 0.9) == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("name", "settings", "limit", "gamma", "initial_q", "epsilon", "stages"),
    [
        ("FrozenLake-v1", {"is_slippery": False}, 100, 0.99, 1.0, 0.1, {0.5: 1000}),
        pytest.param("FrozenLake-v1", {}, 100, 0.99, 1.0, 0.1, {0.01: 20_000}, marks=pytest.mark.compiled),
        ("FrozenLake8x8-v1", {"is_slippery": False}, 200, 0.99, 1.0, 0.1, {0.5: 3000}),
        pytest.param("FrozenLake8x8-v1", {}, 200, 0.999, 1.0, 0.2, {0.02: 40_000}, marks=pytest.mark.compiled),
        ("CliffWalking-v1", {}, None, 0.99, 0.0, 0.1, {1.0: 1000}),
        pytest.param(
            "CliffWalkingSlippery-v1",
            {},
            None,
            0.99,
            0.0,
            0.2,
            {0.1: 10_000, 0.01: 20_000, 0.001: 30_000},
            marks=pytest.mark.compiled,
        ),
        pytest.param("Taxi-v4", {}, 200, 0.99, 0.0, 0.3, {1.0: 20_000}, marks=pytest.mark.compiled),
        pytest.param(
            "Taxi-v4",
            {"is_rainy": True},
            200,
            0.99,
            0.0,
            0.4,
            {0.1: 50_000, 0.01: 100_000, 0.001: 150_000},
            marks=pytest.mark.compiled,
        ),
    ],
)
def test_what_is_learned_reaches_the_optimum(
    name: str,
    settings: dict[str, Any],
    limit: int | None,
    gamma: float,
    initial_q: float,
    epsilon: float,
    stages: dict[float, int],
) -> None:
    mdp = extracted(made(name, **settings))
    q: Any = initial_q
    for alpha, episodes in stages.items():
        learner = QLearning(mdp.with_time_limit(limit), alpha=alpha, gamma=gamma, epsilon=epsilon, initial_q=q, seed=0)
        q = learner.learn(episodes).q[0]
    assert regret(model_of(mdp), q, gamma) <= 0.01
