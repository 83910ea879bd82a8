"""What came out of a comparison: the paired difference, the same against the control, and curves."""

import math
from typing import Any, NamedTuple

import numpy as np
import polars as pl

from tuckerl.adapters.joint import agents_of
from tuckerl.adapters.making import make_environment
from tuckerl.adapters.resolve import Agents
from tuckerl.studies.comparison import ComparisonStudy
from tuckerl.studies.environments import has_several_agents
from tuckerl.studies.runner import StudyTables
from tuckerl.studies.statistics import (
    MEASURES,
    Difference,
    Measure,
    compare_with_control,
    finite_values,
    json_numbers,
    mean_band,
)
from tuckerl.studies.summary import Curve, Samples, mean_seconds, paired_curves, samples_of
from tuckerl.types import FloatArray, IntArray

MOST_POINTS = 100  # of a curve: with more episodes, each point is the mean of several
VERDICTS = {"holds": "better", "does not hold": "worse", "not decided": "not decided"}


class Estimate(NamedTuple):
    """A variant's mean over runs; NaN where it is not known."""

    variant: str
    mean: float
    low: float  # 95 % interval of the mean over runs, by Student's t
    high: float
    n_runs: int
    n_diverged: int
    seconds: float  # processor time of a run and agent

    def to_dict(self) -> dict[str, Any]:
        """Return the variant's entry in ``compare.json``."""
        numbers = json_numbers(self[1:4], "mean", "low", "high")
        return {"variant": self.variant} | numbers | {"runs": self.n_runs, "diverged": self.n_diverged}


class ComparisonResult(NamedTuple):
    """A comparison and its result."""

    study: ComparisonStudy
    difference: Difference  # of the candidate to the base
    control: Difference  # of the candidate to the control; nothing where there is none
    estimates: tuple[Estimate, ...]  # in the order of the variants: base, candidate, control
    episode: IntArray  # (P,) the last one that each point of the curves stands for
    curves: tuple[Curve, ...]  # by points: the measured quantity in an episode

    @property
    def verdict(self) -> str:
        """Whether the candidate is "better", "worse" or it is "not decided"."""
        return VERDICTS[self.difference.verdict]

    @property
    def measure(self) -> Measure:
        """What is measured."""
        return MEASURES[self.study.config.measure]

    def to_dict(self) -> dict[str, Any]:
        """Return the content of ``compare.json``."""
        config, comparison = self.study.config, self.study.comparison
        return {
            "base": comparison.base,
            "candidate": comparison.candidate,
            "environment": config.environment,
            "environment_keywords": dict(config.keywords),
            "measure": config.measure,
            "larger_is_better": self.measure.larger_is_better,
            "verdict": self.verdict,
            "relative": self.difference.relative,
            **json_numbers(self.difference, "difference", "low", "high"),
            "control": comparison.control or None,
            **json_numbers(self.control, "control_difference", "control_low", "control_high"),
            "no_control": self.study.no_control or None,
            "runs": self.difference.n_pairs,
            "diverged": self.difference.n_diverged,
            "episodes": config.n_episodes,
            "seed": config.seed,
            "variants": [estimate.to_dict() for estimate in self.estimates],
        }


def summarise_comparison(study: ComparisonStudy, tables: StudyTables) -> ComparisonResult:
    """Return what came out of a comparison's study."""
    config, measure = study.config, MEASURES[study.config.measure]
    entropy = [config.seed, study.scenario.number]
    difference, control = compare_with_control(tables.runs, study.comparison, entropy)
    per_point = math.ceil(config.n_episodes / MOST_POINTS)
    names = [variant.name for variant in study.scenario.variants]
    samples = {
        name: _by_points(samples_of(tables.runs.filter(pl.col("variant") == name), measure.column), per_point)
        for name in names
    }
    seconds = mean_seconds(tables.times)
    estimates = (
        _estimate(name, finite_values(tables.runs, name, measure), samples[name].n_diverged, seconds[name])
        for name in names
    )
    episode = np.minimum(np.arange(1, math.ceil(config.n_episodes / per_point) + 1) * per_point, config.n_episodes)
    return ComparisonResult(study, difference, control, tuple(estimates), episode, paired_curves(samples))


def means_by_agent(study: ComparisonStudy, tables: StudyTables) -> dict[str, dict[str, float]]:
    """Return each agent's mean return by the name of a variant, and by its own, where agents share a world.

    Variants of a joint table, and those whose agents all got the same, are left out.
    """
    config = study.config
    if not has_several_agents(config.environment):
        return {}
    env: Any = make_environment(config.environment, config.keywords)
    names = [str(agent) for agent in agents_of(env)]
    env.close()
    means: dict[str, dict[str, float]] = {}
    for variant in study.scenario.variants:
        runs = tables.runs.filter(pl.col("variant") == variant.name)
        by_agent = runs.group_by("agent").agg(pl.col("return").mean()).sort("agent")["return"].to_list()
        is_joint = variant.learner.reads_agents is Agents.JOINT
        if not is_joint and len(by_agent) == len(names) and len(set(by_agent)) > 1 and None not in by_agent:
            means[variant.name] = dict(zip(names, by_agent, strict=True))
    return means


def _by_points(samples: Samples, per_point: int) -> Samples:
    """Return the means over as many episodes as one point stands for."""
    n_episodes = samples.values.shape[1]
    starts = np.arange(0, n_episodes, per_point)
    sums = np.add.reduceat(samples.values, starts, axis=1)
    return samples._replace(values=sums / np.diff([*starts, n_episodes]))


def _estimate(name: str, values: FloatArray, n_diverged: int, seconds: float) -> Estimate:
    mean, low, high = (float(bound[0]) for bound in mean_band(values[:, np.newaxis]))
    if values.size < 2:
        low = high = math.nan
    return Estimate(name, mean, low, high, values.size, n_diverged, seconds)
