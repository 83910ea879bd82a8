"""Bootstrap intervals."""

import warnings
from collections.abc import Callable

import numpy as np

from tuckerl.types import FloatArray

CONFIDENCE = 0.95
N_RESAMPLES = 9999
_MOST_DRAWN = 10_000_000  # numbers at once
ROUNDING = 1e-12
"""What differs by less, as a part of the numbers that it was made of, is equal: sums of some thousand terms do."""


def bca_interval(
    samples: tuple[FloatArray, ...], statistic: Callable[..., FloatArray], rng: np.random.Generator
) -> tuple[float, float]:
    """Return the 95 % interval of a statistic by the bias-corrected and accelerated bootstrap (Efron 1987).

    Parameters
    ----------
    samples : arrays of n numbers
        Several are paired: what has one place in them is drawn together.
    statistic : callable
        Of as many arrays as there are samples, along `axis`. Where all numbers are equal but for rounding, see
        `is_constant`, its rounding is all that varies: ask that first.
    rng : numpy.random.Generator

    Returns
    -------
    low, high : float
        NaN where there is one number only, or none. Where the statistic without each number in turn is the same, for
        which BCa is not defined, the interval is the plain percentile one.
    """
    from scipy import stats  # takes longer to import than to play many an environment

    if samples[0].size < 2:
        return np.nan, np.nan
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # SciPy's, where BCa is not defined
        result = stats.bootstrap(
            samples,
            statistic,
            n_resamples=N_RESAMPLES,
            confidence_level=CONFIDENCE,
            method="BCa",
            paired=True,
            vectorized=True,
            batch=max(1, min(1000, _MOST_DRAWN // samples[0].size)),
            rng=rng,
        )
    low, high = map(float, result.confidence_interval)
    if np.isnan(low) or np.isnan(high):
        tail = (1 - CONFIDENCE) / 2
        low, high = map(float, np.quantile(result.bootstrap_distribution, [tail, 1 - tail]))
    return low, high


def is_constant(values: FloatArray, magnitude: float) -> bool:
    """Return whether several values are equal but for the rounding of numbers of this magnitude."""
    return values.size > 1 and bool(np.ptp(values) <= ROUNDING * magnitude)
