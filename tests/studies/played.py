"""Runs that are played here and now, into tables as a folder would give them."""

import polars as pl

from tuckerl.studies.playing import play_run
from tuckerl.studies.runs import Run, all_runs
from tuckerl.studies.study import Study
from tuckerl.studies.tables import KEY, SCHEMAS, StudyTables


def keyed(run: Run, tables: StudyTables) -> StudyTables:
    """Return what a run has left, with its name before each row."""
    names = [pl.lit(value, dtype=KEY[column]).alias(column) for column, value in run._asdict().items()]
    return StudyTables(*(frame.select(*names, pl.all()).cast(SCHEMAS[n]) for n, frame in tables._asdict().items()))


def first_runs(study: Study) -> StudyTables:
    """Play the first run of the first instance, with all variants."""
    runs = [run for run in all_runs(study) if (run.instance, run.run) == (0, 0)]
    played = [keyed(run, play_run(study, run)) for run in runs]
    return StudyTables(*(pl.concat(frames) for frames in zip(*played, strict=True)))
