"""BCa intervals: of one sample, of paired ones, of too little."""

import warnings

import numpy as np
import pytest
from scipy import stats

from tuckerl.intervals import CONFIDENCE, N_RESAMPLES, bca_interval, is_constant
from tuckerl.types import FloatArray

VALUES = np.random.default_rng(0).exponential(size=30)


def test_of_a_mean_it_is_scipys() -> None:
    expected = stats.bootstrap(
        (VALUES,), np.mean, n_resamples=N_RESAMPLES, confidence_level=CONFIDENCE, rng=np.random.default_rng(1)
    ).confidence_interval
    assert bca_interval((VALUES,), np.asarray, np.random.default_rng(1)) == pytest.approx(expected, rel=1e-12)


def ratio(one: FloatArray, other: FloatArray) -> FloatArray:
    return one / other


def test_of_a_ratio_of_paired_means_it_is_scipys() -> None:
    others = VALUES + np.random.default_rng(2).uniform(size=VALUES.size)

    def of_samples(one: FloatArray, other: FloatArray, axis: int = -1) -> FloatArray:
        return ratio(one.mean(axis=axis), other.mean(axis=axis))

    expected = stats.bootstrap(
        (VALUES, others),
        of_samples,
        paired=True,
        n_resamples=N_RESAMPLES,
        batch=1000,
        confidence_level=CONFIDENCE,
        rng=np.random.default_rng(1),
    ).confidence_interval
    assert bca_interval((VALUES, others), ratio, np.random.default_rng(1)) == pytest.approx(expected, rel=1e-12)


def test_two_numbers_have_one() -> None:
    low, high = bca_interval((np.array([1.0, 3.0]),), np.asarray, np.random.default_rng(1))
    assert 1.0 <= low < 2.0 < high <= 3.0


def test_where_leaving_any_number_out_changes_nothing_it_is_the_percentile_interval() -> None:
    def rounded(mean: FloatArray) -> FloatArray:
        return np.asarray(np.round(mean))

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        low, high = bca_interval((np.array([0.0, 1.0, 1.0, 1.0, 1.0, 2.0]),), rounded, np.random.default_rng(1))
    assert low <= 1.0 <= high


def test_what_differs_by_rounding_is_constant() -> None:
    orders = np.array([0.1 + 0.2 + 0.3, 0.3 + 0.2 + 0.1])
    assert np.ptp(orders) > 0
    assert is_constant(orders, 0.6)
    assert not is_constant(np.array([0.6, 0.6000001]), 0.6)
    assert not is_constant(orders[:1], 0.6)


def test_one_number_has_none() -> None:
    assert np.isnan(bca_interval((VALUES[:1],), np.asarray, np.random.default_rng(1))).all()
    assert np.isnan(bca_interval((VALUES[:0],), np.asarray, np.random.default_rng(1))).all()
