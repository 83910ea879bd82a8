"""The folder of a study that came from a file: the file itself stands in it, so that nothing else is needed."""

import json
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import polars as pl

from tuckerl.checks import check_int, check_name, shown
from tuckerl.errors import OutputError, ParameterError
from tuckerl.files import is_file, write_whole
from tuckerl.studies.estimates import Estimate, Reached
from tuckerl.studies.parts import Parts
from tuckerl.studies.reproduce import Progress, run_study
from tuckerl.studies.run_progress import RunProgress
from tuckerl.studies.runs import run_identities
from tuckerl.studies.store import Results
from tuckerl.studies.study import Study, Variant
from tuckerl.studies.study_file import AGENTS, StudyFile, read_study_file
from tuckerl.studies.tables import SCHEMAS, StudyTables
from tuckerl.studies.variants import algorithm_of

FILE = "study.toml"
FORMATS = ("csv", "parquet")
_LOOKS = 10


class VariantStatus(NamedTuple):
    """How far a variant is on a problem, and what it has reached so far."""

    problem: str
    n_runs: int  # in all
    n_finished: int
    estimate: Estimate  # of what the study measures, of the finished runs


class StudyStatus(NamedTuple):
    """How far a study is."""

    measure: str
    variants: tuple[VariantStatus, ...]
    n_failed: int = 0  # runs that ended with an error; the next `run` plays them again
    n_of_other_code: int = 0  # finished runs that are left out, as other code has played them than there is now

    @property
    def n_runs(self) -> int:
        """Number of runs in all."""
        return sum(one.n_runs for one in self.variants)

    @property
    def n_finished(self) -> int:
        """Number of runs that are finished."""
        return sum(one.n_finished for one in self.variants)

    @property
    def n_diverged(self) -> int:
        """Number of finished runs that diverged."""
        return sum(one.estimate.n_diverged for one in self.variants)


def kept_file(folder: Path) -> StudyFile:
    """Return the study file that a folder was made from.

    Raises
    ------
    ParameterError, UnknownNameError
        If there is none, or something is wrong in it.
    """
    path = folder / FILE
    if not is_file(path):
        try:
            is_folder = folder.is_dir()
        except OSError as error:
            raise ParameterError(f"cannot look into {shown(str(folder))}: {error.strerror}") from error
        if is_file(folder):
            raise ParameterError(
                f"{folder} is a file, and a folder was asked for: `tuckerl study run {folder}` plays it"
            )
        if is_folder and is_file(folder / "study.json"):
            raise ParameterError(
                f"{folder} holds a study that came from no file: the `tuckerl reproduce`, `compare` or `tune` that "
                "made it goes on with it, and writes its report; `tuckerl study status` says how far it is"
            )
        what = f"holds no {FILE}, so no study was run into it from a file" if is_folder else "is no folder"
        raise ParameterError(f"{folder} {what}: `tuckerl study run FILE --out {folder}` makes one")
    return read_study_file(path)


def play_study(
    file: StudyFile,
    study: Study,
    folder: Path,
    *,
    workers: int | None = None,
    cluster: str | None = None,
    overwrite: bool = False,
    accept_code: bool = False,
    runs: int | None = None,
    progress: Progress | None = None,
) -> StudyTables:
    """Play what is missing of a study in its folder, and return all its tables.

    Parameters
    ----------
    file : StudyFile
        A copy of which is kept in the folder.
    study : Study
        Of the file.
    folder : Path
    workers, cluster, overwrite, accept_code
        As of :func:`~tuckerl.studies.reproduce.run_study`.
    runs : int, optional
        Only so many runs of each variant for now, where it has more.
    progress : callable, optional

    Raises
    ------
    ParameterError, ParameterTypeError
        If a number is impossible.
    OutputError, OutputConflictError
        If the folder cannot be written, or holds another study's results, or runs of other code, and nothing says
        what to do with them.
    """
    if runs is not None:
        most = check_int("runs", runs, 1)
        study = replace(study, scenarios=tuple(one.resized(n_runs=min(one.n_runs, most)) for one in study.scenarios))
    kept = False

    def report(runs: RunProgress) -> None:
        nonlocal kept
        if not kept:  # from here on, the folder is this study's
            write_whole(folder / FILE, file.text.encode())
            kept = True
        if progress is not None:
            progress(runs)

    return run_study(
        study,
        folder,
        workers=workers,
        cluster=cluster,
        overwrite=overwrite,
        accept_code=accept_code,
        progress=report,
    )


class KeptRuns(NamedTuple):
    """What a folder holds of a study's runs."""

    tables: StudyTables  # of those that are finished
    n_failed: int
    n_of_other_code: int  # finished, but left out, unless that code was accepted


def kept_runs(study: Study, folder: Path) -> KeptRuns:
    """Return what a folder holds of a study, also while another process adds to it.

    Raises
    ------
    OutputError
        If it cannot be read.
    """
    try:
        for _ in range(_LOOKS):
            with suppress(FileNotFoundError):  # the other process has just put several parts into one
                return _kept_now(study, folder)
        return _kept_now(study, folder)
    except OSError as error:
        raise OutputError(f"cannot read {folder}: {error.strerror or error}") from error


def _kept_now(study: Study, folder: Path) -> KeptRuns:
    results = Results(folder, study)
    finished, of_other_code = results.finished(), 0
    if len(finished) < study.n_runs:
        stored = Parts(folder / "parts").stored
        of_other_code = sum(one in stored and run not in finished for run, one in run_identities(study).items())
    return KeptRuns(results.tables, len(results.failures()), of_other_code)


def status_of(study: Study, kept: KeptRuns, reached: list[Reached]) -> StudyStatus:
    """Return how far a study is, by what its folder holds and what its variants have reached there."""
    variants = []
    for scenario, own in zip(study.scenarios, reached, strict=True):
        n_finished = own.n_finished()
        variants += [
            VariantStatus(scenario.name, scenario.n_runs_of_each, n_finished.get(one.name, 0), own.estimate(one.name))
            for one in scenario.variants
        ]
    return StudyStatus(study.scenarios[0].measure, tuple(variants), kept.n_failed, kept.n_of_other_code)


NOTHING_KEPT = KeptRuns(StudyTables(**{name: pl.DataFrame(schema=schema) for name, schema in SCHEMAS.items()}), 0, 0)


def export_format(out: Path | None, form: str | None) -> str:
    """Return the format of an export: that which is named, or else that of the file's ending, or else CSV.

    Raises
    ------
    UnknownNameError
        If there is no such format.
    """
    if form is not None:
        return check_name("format", form, FORMATS)
    ending = out.suffix.removeprefix(".").lower() if out is not None else FORMATS[0]
    if ending in FORMATS:
        return ending
    raise ParameterError(f"the file must end in .csv or .parquet, or the format be named; got {shown(str(out))}")


def exported(study: Study, tables: StudyTables, varied: Iterable[str]) -> pl.DataFrame:
    """Return a row for each run, agent and episode: what was played, by what, and what came of it.

    The instance is told where a problem has several.

    Parameters
    ----------
    study : Study
    tables : StudyTables
    varied : names
        Of settings, or "agents"; a column for each, as text where not all values are numbers.
    """
    names = list(dict.fromkeys(varied))
    keys: dict[str, list[Any]] = {"scenario": [], "variant": [], "algorithm": []}
    settings: dict[str, list[Any]] = {name: [] for name in names}
    for scenario, variant in ((one, variant) for one in study.scenarios for variant in one.variants):
        for key, value in zip(keys, (scenario.name, variant.name, algorithm_of(variant).name), strict=True):
            keys[key].append(value)
        for name in names:
            settings[name].append(_setting(variant, name))
    columns = pl.DataFrame(keys | {name: _column(values) for name, values in settings.items()}, strict=False)
    joined = tables.runs.join(columns, on=["scenario", "variant"], how="left", maintain_order="left")
    one_each = all(scenario.n_instances == 1 for scenario in study.scenarios)
    rest = [name for name in tables.runs.columns if name not in ("scenario", "variant", "instance" if one_each else "")]
    return joined.select(pl.col("scenario").alias("problem"), "variant", "algorithm", *names, *rest)


def _setting(variant: Variant, name: str) -> Any:
    """Return what a variant was given for a setting; None where that was left to the default, or is none of its."""
    if name == AGENTS:
        return variant.n_agents
    return variant.parameters.get(name, getattr(variant.tensor_step, name, None))


def _column(values: list[Any]) -> list[Any]:
    """Return values of one type: numbers where they are all such, or else texts."""
    present = [value for value in values if value is not None]
    if all(isinstance(value, (int, float)) and not isinstance(value, bool) for value in present):
        return values
    return [None if value is None else _written(value) for value in values]


def _written(value: Any) -> str:
    return json.dumps(value) if isinstance(value, (bool, int, float, list, tuple)) else str(value)
