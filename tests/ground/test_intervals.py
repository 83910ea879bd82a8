"""BCa intervals: of one sample, of paired ones, of too little."""

import numpy as np
import pytest
from scipy import stats

from tuckerl.intervals import CONFIDENCE, N_RESAMPLES, bca_interval
from tuckerl.types import FloatArray

VALUES = np.random.default_rng(0).exponential(size=30)


def test_of_a_mean_it_is_scipys() -> None:
    expected = stats.bootstrap(
        (VALUES,), np.mean, n_resamples=N_RESAMPLES, confidence_level=CONFIDENCE, rng=np.random.default_rng(1)
    ).confidence_interval
    assert bca_interval((VALUES,), np.mean, np.random.default_rng(1)) == (expected.low, expected.high)


def test_samples_are_paired() -> None:
    def difference(one: FloatArray, other: FloatArray, axis: int = -1) -> FloatArray:
        mean: FloatArray = (other - one).mean(axis=axis)
        return mean

    low, high = bca_interval((VALUES, VALUES + 1 + 1e-9 * VALUES), difference, np.random.default_rng(1))
    assert [low, high] == pytest.approx([1.0, 1.0]), "unpaired, it would be as wide as the values are"


def test_one_number_has_none() -> None:
    assert np.isnan(bca_interval((VALUES[:1],), np.mean, np.random.default_rng(1))).all()
    assert np.isnan(bca_interval((VALUES[:0],), np.mean, np.random.default_rng(1))).all()
