"""Bootstrap intervals."""

from collections.abc import Callable

import numpy as np

from tuckerl.types import FloatArray, IntArray

CONFIDENCE = 0.95
N_RESAMPLES = 9999
_MOST_DRAWN = 10_000_000  # numbers at once
ROUNDING = 1e-12
"""What differs by less, as a part of the numbers that it was made of, is equal: sums of some thousand terms do."""


def bca_interval(
    samples: tuple[FloatArray, ...], statistic: Callable[..., FloatArray], rng: np.random.Generator
) -> tuple[float, float]:
    """Return the 95 % interval of a statistic of means by the bias-corrected and accelerated bootstrap (Efron 1987).

    It is `scipy.stats.bootstrap`'s to rounding, at a cost that grows with n, not with its square: the means without
    each number in turn follow from the sum. And SciPy's takes longer to import than to play many an environment.

    Parameters
    ----------
    samples : arrays of n numbers
        Several are paired: what has one place in them is drawn together.
    statistic : callable
        Of an array of means for each sample, entry by entry. Where all numbers are equal but for rounding, see
        `is_constant`, its rounding is all that varies: ask that first.
    rng : numpy.random.Generator

    Returns
    -------
    low, high : float
        NaN where there is one number only, or none. Where the statistic without each number in turn is the same, for
        which BCa is not defined, the interval is the plain percentile one.
    """
    from scipy.special import ndtr, ndtri

    n = samples[0].size
    if n < 2:
        return np.nan, np.nan
    batch = max(1, min(1000, _MOST_DRAWN // n))
    resampled = np.concatenate(
        [
            _resampled(samples, statistic, rng.integers(0, n, (min(batch, N_RESAMPLES - first), n)))
            for first in range(0, N_RESAMPLES, batch)
        ]
    )
    whole = statistic(*(sample.mean() for sample in samples))
    without_one = statistic(*((sample.sum() - sample) / (n - 1) for sample in samples))
    influence = without_one.mean() - without_one
    ends = np.array([(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2])
    with np.errstate(all="ignore"):  # where BCa is not defined
        acceleration = (influence**3).sum() / (6 * (influence**2).sum() ** 1.5)
        bias = ndtri(((resampled < whole).mean() + (resampled <= whole).mean()) / 2)
        shifted = bias + ndtri(ends)
        levels = ndtr(bias + shifted / (1 - acceleration * shifted))
    low, high = np.quantile(resampled, ends if np.isnan(levels).any() else levels)
    return float(low), float(high)


def _resampled(samples: tuple[FloatArray, ...], statistic: Callable[..., FloatArray], drawn: IntArray) -> FloatArray:
    """Return the statistic of resamples, one for each row of the places that were `drawn`, (B, n)."""
    return statistic(*(sample[drawn].mean(axis=-1) for sample in samples))


def is_constant(values: FloatArray, magnitude: float) -> bool:
    """Return whether several values are equal but for the rounding of numbers of this magnitude."""
    return values.size > 1 and bool(np.ptp(values) <= ROUNDING * magnitude)
