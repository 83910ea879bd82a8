import numpy as np
import polars as pl
import pytest
from scipy import stats

from tuckerl.studies.statistics import MEASURES, compare, mean_band, paired_difference, pairs_by_variant
from tuckerl.types import FloatArray


def runs_frame(steps: dict[str, list[list[list[list[int | None]]]]]) -> pl.DataFrame:
    """Return runs from steps[variant][instance][run][agent][episode]; None from where a run diverged."""
    rows = [
        {
            "scenario": "s",
            "variant": variant,
            "instance": i,
            "run": r,
            "agent": j,
            "episode": e,
            "steps": value,
            "return": None if value is None else -float(value),
            "diverged": value is None,
        }
        for variant, instances in steps.items()
        for i, instance in enumerate(instances)
        for r, run in enumerate(instance)
        for j, agent in enumerate(run)
        for e, value in enumerate(agent)
    ]
    return pl.DataFrame(rows, schema_overrides={"steps": pl.Int64, "return": pl.Float64})


def test_cost_sums_over_instances_and_episodes_and_averages_agents() -> None:
    # two mazes, one run, two agents, two episodes
    runs = runs_frame({"a": [[[[1, 2], [3, 4]]], [[[10, 20], [30, 40]]]]})
    pairs = pairs_by_variant(runs, MEASURES["cost"])["a"]
    assert pairs.value.tolist() == [(1 + 2 + 10 + 20 + 3 + 4 + 30 + 40) / 2]


def test_path_is_each_agents_shortest_episode_and_instances_are_pairs() -> None:
    runs = runs_frame({"a": [[[[5, 2], [3, 4]]], [[[10, 20], [30, 40]]]]})
    pairs = pairs_by_variant(runs, MEASURES["path"])["a"]
    assert pairs.value.tolist() == [(2 + 3) / 2, (10 + 30) / 2]


def test_a_pair_of_one_variant_is_that_of_the_other_also_where_instances_are_pairs() -> None:
    runs = runs_frame({"base": [[[[5]], [[7]]], [[[10]], [[20]]]], "other": [[[[4]], [[6]]], [[[9]], [[19]]]]})
    pairs = pairs_by_variant(runs, MEASURES["path"])
    assert pairs["base"].key.tolist() == pairs["other"].key.tolist() == [0, 1, 2**32, 2**32 + 1]
    assert pairs["base"].value.tolist() == [5, 7, 10, 20]
    result = compare(runs, "base", "other", MEASURES["path"], np.random.default_rng(0), relative=False)
    assert (result.n_pairs, result.mean) == (4, 1)


def test_difference_is_in_the_claims_favour_over_the_bases_mean() -> None:
    runs = runs_frame({"base": [[[[10]], [[20]], [[30]]]], "better": [[[[8]], [[17]], [[29]]]]})
    result = compare(runs, "base", "better", MEASURES["cost"], np.random.default_rng(0))
    assert result.mean == pytest.approx((2 + 3 + 1) / 60)
    assert result.n_pairs == 3
    assert result.low < result.mean < result.high
    assert result.verdict == "holds"
    worse = compare(runs, "better", "base", MEASURES["cost"], np.random.default_rng(0))
    assert worse.mean == pytest.approx(-6 / 54)
    assert worse.verdict == "does not hold"


def test_a_diverged_run_leaves_its_pair_and_is_counted() -> None:
    runs = runs_frame({"base": [[[[10]], [[20]], [[30]]]], "other": [[[[8]], [[None]], [[29]]]]})
    result = compare(runs, "base", "other", MEASURES["cost"], np.random.default_rng(0))
    assert (result.n_pairs, result.n_diverged) == (2, 1)
    assert result.mean == pytest.approx(3 / 40)


def test_one_diverged_instance_takes_the_whole_cost_pair() -> None:
    runs = runs_frame({"base": [[[[1]], [[2]]], [[[3]], [[4]]]], "other": [[[[1]], [[2]]], [[[None]], [[4]]]]})
    result = compare(runs, "base", "other", MEASURES["cost"], np.random.default_rng(0))
    assert (result.n_pairs, result.n_diverged) == (1, 1)


def test_interval_is_scipys_bca_of_the_relative_difference() -> None:
    rng = np.random.default_rng(1)
    base = rng.gamma(5.0, 20.0, 40)
    candidate = 0.9 * base + rng.normal(0, 5, 40)
    result = paired_difference(base, candidate, -1.0, 0, np.random.default_rng(2))
    oracle = stats.bootstrap(
        (base, candidate),
        lambda b, c: (b.mean() - c.mean()) / b.mean(),
        paired=True,
        vectorized=False,
        n_resamples=9999,
        method="BCa",
        rng=np.random.default_rng(3),
    ).confidence_interval
    assert result.low == pytest.approx(oracle.low, abs=0.005)
    assert result.high == pytest.approx(oracle.high, abs=0.005)


def test_interval_covers_the_truth_about_as_often_as_it_says() -> None:
    rng = np.random.default_rng(4)
    covered = 0
    for _ in range(200):
        base = rng.normal(100, 10, 80)
        candidate = base - 5 + rng.normal(0, 10, 80)
        result = paired_difference(base, candidate, -1.0, 0, rng)
        covered += result.low <= 0.05 <= result.high
    assert 181 <= covered <= 199


@pytest.mark.parametrize(
    ("base", "candidate", "verdict"),
    [([5.0, 5.0], [5.0, 5.0], "not decided"), ([4.0, 8.0], [2.0, 4.0], "holds"), ([3.0], [1.0], "not decided")],
)
def test_samples_without_spread_have_defined_intervals(base: list[float], candidate: list[float], verdict: str) -> None:
    result = paired_difference(np.array(base), np.array(candidate), -1.0, 0, np.random.default_rng(0))
    assert result.verdict == verdict
    assert result.mean == pytest.approx((np.mean(base) - np.mean(candidate)) / np.mean(base))


STARTS = 0.1 * np.arange(20)  # 0.1 i + 1 less 0.1 i is 1 but for rounding


@pytest.mark.parametrize(
    ("base", "candidate", "relative", "mean", "verdict"),
    [
        (STARTS, STARTS + 1.0, False, 1.0, "holds"),
        (STARTS[:2], STARTS[:2] + 1.0, False, 1.0, "holds"),
        (STARTS + 1.0, 1.1 * (STARTS + 1.0), True, 0.1, "holds"),
        (STARTS + 1.0, STARTS, False, -1.0, "does not hold"),
        (STARTS, STARTS + 0.1 - 0.1, False, 0.0, "not decided"),  # better by nothing but rounding
        (STARTS + 1.0, (STARTS + 1.0) * (1 + 2e-16), True, 0.0, "not decided"),
    ],
)
def test_pairs_that_differ_by_one_number_but_for_rounding(
    base: FloatArray, candidate: FloatArray, relative: bool, mean: float, verdict: str
) -> None:
    result = paired_difference(base, candidate, 1.0, 0, np.random.default_rng(0), relative=relative)
    assert result.low == result.mean == result.high == pytest.approx(mean, rel=1e-12)
    assert result.verdict == verdict


def test_no_pairs_decide_nothing() -> None:
    empty = np.zeros(0)
    result = paired_difference(empty, empty, -1.0, 3, np.random.default_rng(0))
    assert np.isnan(result.mean)
    assert result.verdict == "not decided"


def test_the_band_is_students_interval() -> None:
    samples = np.random.default_rng(5).normal(size=(12, 3)).cumsum(axis=1)
    band = mean_band(samples)
    for t in range(3):
        low, high = stats.ttest_1samp(samples[:, t], 0).confidence_interval(0.95)
        assert band.low[t] == pytest.approx(low)
        assert band.high[t] == pytest.approx(high)
    alone = mean_band(samples[:1])
    assert np.array_equal(alone.low, alone.high)
