"""What figures and the report show: numbers worked out from the tables of a study, and nothing to work out any more."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import polars as pl

from tuckerl.studies.claims import Claim, judge_claims
from tuckerl.studies.statistics import MEASURES, Band, Measure, mean_band
from tuckerl.studies.study import Scenario, Study, Variant
from tuckerl.studies.tables import StudyTables
from tuckerl.types import FloatArray, IntArray


class Samples(NamedTuple):
    """A variant's series of numbers in each run."""

    runs: IntArray  # (n,) those in which nothing diverged
    values: FloatArray  # (n, E)
    n_diverged: int


NO_SAMPLES = Samples(np.zeros(0, dtype=np.int64), np.zeros((0, 0)), 0)


class Curve(NamedTuple):
    """A variant's course over the episodes."""

    variant: str
    band: Band  # (E,) of what is measured: cumulative in the figures of scenarios
    against_base: Band  # (E,) this variant minus the first one, paired over the runs that neither left early
    n_runs: int
    n_diverged: int
    samples: Samples = NO_SAMPLES  # the runs that the band is made of


class WeightCourse(NamedTuple):
    """A variant's action weights over the windows."""

    variant: str
    episode: IntArray  # (W,) the episode after which the weights hold
    bands: tuple[Band, ...]  # one for each action, (W,)
    n_runs: int = 0  # behind each mean
    chosen: tuple[FloatArray, ...] = ()  # (W,) for each agent: the part of the runs in which it is the one to copy


class Path(NamedTuple):
    """The shortest episode of a variant's best agent in the recorded run."""

    variant: str
    states: IntArray
    episodes: tuple[IntArray, ...] = ()  # the states of each of that agent's episodes; of older results none


class Summary(NamedTuple):
    """One scenario's results."""

    scenario: Scenario
    curves: tuple[Curve, ...]
    weights: tuple[WeightCourse, ...]
    paths: tuple[Path, ...]
    best_episodes: dict[str, float]  # by variant: what is measured in an agent's best episode, mean over all
    seconds: dict[str, float]  # by variant: mean processor time of a run and agent

    @property
    def measure(self) -> Measure:
        """What is measured."""
        return MEASURES[self.scenario.measure]


def summarise(study: Study, tables: StudyTables) -> tuple[list[Claim], list[Summary]]:
    """Return the claims' verdicts and a summary of each scenario."""
    claims = judge_claims(study, tables)
    return claims, [_summary(scenario, tables) for scenario in study.scenarios]


def _summary(scenario: Scenario, tables: StudyTables) -> Summary:
    runs, weights, paths, times = (frame.filter(pl.col("scenario") == scenario.name) for frame in tables)
    names = [variant.name for variant in scenario.variants]
    measure = MEASURES[scenario.measure]
    measured = pl.col(measure.column)
    best = measured.max() if measure.larger_is_better else measured.min()
    best_episodes = runs.group_by("variant", "instance", "run", "agent").agg(best).group_by("variant")
    samples = {name: samples_of(runs.filter(pl.col("variant") == name), measure.column) for name in names}
    weighted = set(weights["variant"])
    return Summary(
        scenario,
        paired_curves({name: own._replace(values=own.values.cumsum(axis=1)) for name, own in samples.items()}),
        tuple(
            _weight_course(variant, weights.filter(pl.col("variant") == variant.name))
            for variant in scenario.variants
            if variant.name in weighted
        ),
        tuple(_path(name, paths.filter(pl.col("variant") == name)) for name in scenario.record_paths_of),
        dict(best_episodes.agg(measured.mean().fill_null(np.nan)).iter_rows()),
        mean_seconds(times),
    )


def mean_seconds(times: pl.DataFrame) -> dict[str, float]:
    """Return the mean processor time of a run and agent, by variant."""
    return dict(times.group_by("variant").agg((pl.col("seconds") / pl.col("agents")).mean()).iter_rows())


def paired_curves(samples: Mapping[str, Samples]) -> tuple[Curve, ...]:
    """Return each variant's curve, paired with the first one's."""
    base = next(iter(samples.values()))
    return tuple(
        Curve(name, mean_band(own.values), paired_band(own, base)[0], own.runs.size, own.n_diverged, own)
        for name, own in samples.items()
    )


def paired_band(samples: Samples, base: Samples) -> tuple[Band, int]:
    """Return the band of the differences from another variant's runs, and how many runs both have."""
    _, here, there = np.intersect1d(samples.runs, base.runs, return_indices=True)
    return mean_band(samples.values[here] - base.values[there]), here.size


def samples_of(runs: pl.DataFrame, column: str) -> Samples:
    """Return a variant's steps or returns in each episode of its runs: agents averaged, summed over instances."""
    by_run = runs.group_by("run").agg(pl.col("diverged").any())
    kept = by_run.filter(~pl.col("diverged"))["run"].sort()
    cells = (
        runs.filter(pl.col("run").is_in(kept.implode()))
        .group_by("instance", "run", "episode")
        .agg(pl.col(column).mean())
        .group_by("run", "episode")
        .agg(pl.col(column).sum())
        .sort("run", "episode")
    )
    n_episodes = int(runs["episode"].max() or 0) + 1  # type: ignore[arg-type]  # an integer column
    return Samples(kept.to_numpy(), cells[column].to_numpy().reshape(-1, n_episodes), by_run.height - kept.len())


def _weight_course(variant: Variant, weights: pl.DataFrame) -> WeightCourse:
    episode = weights["episode"].unique().sort().to_numpy()
    n_actions = int(weights["action"].max()) + 1  # type: ignore[arg-type]  # an integer column
    complete = weights.filter(pl.len().over("instance", "run") == episode.size * n_actions)
    samples = complete.sort("instance", "run", "episode", "action")["weight"].to_numpy()
    cube = samples.reshape(-1, episode.size, n_actions)
    bands = tuple(mean_band(cube[:, :, action]) for action in range(n_actions))
    chosen = complete.filter(action=0).sort("episode", "instance", "run")["chosen"].to_numpy()
    agents = np.arange(variant.n_agents)[:, np.newaxis, np.newaxis]
    parts = (chosen.reshape(episode.size, -1) == agents).mean(axis=2) if len(cube) else ()
    return WeightCourse(variant.name, episode, bands, len(cube), tuple(parts))


def _path(variant: str, paths: pl.DataFrame) -> Path:
    lengths = paths.group_by("agent", "episode").len().sort("len", "agent", "episode")
    if lengths.is_empty():
        return Path(variant, paths["state"].to_numpy())
    agent, episode, _ = lengths.row(0)
    by_episode = paths.filter(agent=agent).sort("episode", "step").partition_by("episode", maintain_order=True)
    if episode is None:
        return Path(variant, by_episode[0]["state"].to_numpy())
    episodes = tuple(own["state"].to_numpy() for own in by_episode)
    return Path(variant, episodes[episode], episodes)
