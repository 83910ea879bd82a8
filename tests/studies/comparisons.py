"""Small comparisons, played or made by hand, of which the results are known."""

from collections.abc import Mapping, Sequence
from typing import Any

import polars as pl

from tuckerl.studies.comparison import ComparisonConfig, ComparisonStudy, comparison_study
from tuckerl.studies.tables import SCHEMAS, StudyTables

MAZE = "tuckerl/DynaMaze-v0"
SMALL = {"rows": 6, "columns": 9, "start": (2, 0), "goal": (0, 8)}


def config_of(base: str = "sarsa-lambda", candidate: str = "tsarsa-lambda", **changes: Any) -> ComparisonConfig:
    """Return a comparison of tenths of a second."""
    small = ComparisonConfig(base, candidate, MAZE, SMALL, n_runs=2, n_episodes=20, seed=3)
    return small._replace(**changes)


def small_comparison(base: str = "sarsa-lambda", candidate: str = "tsarsa-lambda", **changes: Any) -> ComparisonStudy:
    """Return the study of `config_of`."""
    return comparison_study(config_of(base, candidate, **changes))


def tables_of(made: ComparisonStudy, returns: Mapping[str, Sequence[Sequence[float | None]]]) -> StudyTables:
    """Return tables in which a variant's run r has these returns, and as many steps as the returns are below 0.

    None from some episode on stands for a run that diverged there; every agent does the same.
    """
    runs, times = [], []
    for variant in made.scenario.variants:
        for run, episodes in enumerate(returns[variant.name]):
            key = {"scenario": made.scenario.name, "variant": variant.name, "instance": 0, "run": run}
            times.append(key | {"agents": variant.n_agents, "seconds": 0.01, "tensor_step_seconds": 0.0})
            for agent in range(variant.n_agents):
                for episode, value in enumerate(episodes):
                    steps = None if value is None else round(-value)
                    row = {"agent": agent, "episode": episode, "steps": steps, "return": value}
                    runs.append(key | row | {"diverged": value is None})
    rows = {"runs": runs, "weights": [], "paths": [], "times": times}
    return StudyTables(**{name: pl.DataFrame(rows[name], schema=schema) for name, schema in SCHEMAS.items()})
