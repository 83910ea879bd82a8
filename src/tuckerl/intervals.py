"""Bootstrap intervals."""

from collections.abc import Callable

import numpy as np

from tuckerl.types import FloatArray

CONFIDENCE = 0.95
N_RESAMPLES = 9999


def bca_interval(
    samples: tuple[FloatArray, ...], statistic: Callable[..., FloatArray], rng: np.random.Generator
) -> tuple[float, float]:
    """Return the 95 % interval of a statistic by the bias-corrected and accelerated bootstrap (Efron 1987).

    Parameters
    ----------
    samples : arrays of n numbers
        Several are paired: what has one place in them is drawn together.
    statistic : callable
        Of as many arrays as there are samples, along `axis`; it must vary over the resamples.
    rng : numpy.random.Generator

    Returns
    -------
    low, high : float
        NaN where there is one number only, or none.
    """
    from scipy import stats  # takes longer to import than to play many an environment

    if samples[0].size < 2:
        return np.nan, np.nan
    interval = stats.bootstrap(
        samples,
        statistic,
        n_resamples=N_RESAMPLES,
        confidence_level=CONFIDENCE,
        method="BCa",
        paired=True,
        vectorized=True,
        batch=1000,
        rng=rng,
    ).confidence_interval
    return float(interval.low), float(interval.high)
