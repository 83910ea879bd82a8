"""The tables that runs leave: what was played, what the tensor step decided, the paths that are shown, and the time."""

from typing import Any, NamedTuple

import polars as pl

KEY: dict[str, Any] = {"scenario": pl.String, "variant": pl.String, "instance": pl.Int32, "run": pl.Int32}
_AGENT: dict[str, Any] = {"agent": pl.Int32}
ROWS: dict[str, Any] = {
    "runs": _AGENT | {"episode": pl.Int32, "steps": pl.Int64, "return": pl.Float64, "diverged": pl.Boolean},
    "weights": {
        "episode": pl.Int32,
        "action": pl.Int32,
        "weight": pl.Float64,
        "chosen": pl.Int32,
        "fit": pl.Float64,
    },
    "paths": _AGENT | {"episode": pl.Int32, "step": pl.Int32, "state": pl.Int64},
    "times": {"agents": pl.Int32, "seconds": pl.Float64, "tensor_step_seconds": pl.Float64, "regret": pl.Float64},
}
"""What a row of each table says of one run."""

SCHEMAS: dict[str, Any] = {name: KEY | columns for name, columns in ROWS.items()}
"""The same of a whole study, whose rows say of which run they are."""


class StudyTables(NamedTuple):
    """A table for each kind of fact, of all runs of a study (columns in `SCHEMAS`) or of a single one (`ROWS`)."""

    runs: pl.DataFrame  # steps and return of every episode; null from the one on in which a run diverged
    weights: pl.DataFrame  # what the tensor step decided after every window
    # The states of the recorded variants' episodes; of older results, of the shortest one, whose number is null.
    paths: pl.DataFrame
    # Processor time, and the tensor step's part of it: the one thing that differs between two plays of a run. And the
    # regret of what was learned, where that is asked and known.
    times: pl.DataFrame
