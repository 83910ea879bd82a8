"""A study as its users have it: read from a file, played into a folder, looked at, reported, exported."""

import io
from contextlib import nullcontext
from os import PathLike
from pathlib import Path
from typing import NamedTuple

import polars as pl

from tuckerl.checks import check_flag, check_int, check_path
from tuckerl.errors import ParameterError
from tuckerl.files import is_file, make_folder, write_whole
from tuckerl.reports.live_view import runs_shown
from tuckerl.reports.study_page import outcomes_of, write_study
from tuckerl.reports.text import counted
from tuckerl.studies.estimates import reached_of
from tuckerl.studies.remembered import Remembered
from tuckerl.studies.study_file import StudyFile, parse_study_file, read_study_file
from tuckerl.studies.study_folder import (
    FILE,
    NOTHING_KEPT,
    KeptRuns,
    StudyStatus,
    export_format,
    exported,
    kept_file,
    kept_runs,
    play_study,
    status_of,
)
from tuckerl.studies.study_making import study_of
from tuckerl.studies.study_result import summarise_study
from tuckerl.studies.tables import StudyTables

MOST_RUNS = 1_000_000
"""Runs of a study that are played unasked."""


class StudyReport(NamedTuple):
    """A study's report."""

    page: Path
    outcomes: tuple[str, ...]  # what came out of each comparison, in sentences


class Study:
    """Algorithms on problems, many runs of each, and what is compared with what: as a TOML file says it.

    Everything in it is checked when it is made: each environment and each learner is made once.

    >>> import tuckerl
    >>> study = tuckerl.Study.from_text('''
    ... runs = 2
    ... episodes = 20
    ... [[problem]]
    ... env = "FrozenLake-v1"
    ... [[algorithm]]
    ... algorithm = "q-learning"
    ... grid = { alpha = [0.1, 0.5] }
    ... ''')
    >>> study
    Study of 1 problem, 2 variants and 4 runs
    >>> study.variants
    ('q-learning[alpha=0.1]', 'q-learning[alpha=0.5]')

    Parameters
    ----------
    file : StudyFile
        What stands in a study file; :meth:`from_file` and :meth:`from_text` read it.

    Raises
    ------
    ParameterError, UnknownNameError
        If something in it is wrong: said with the file's name and the line.
    """

    def __init__(self, file: StudyFile) -> None:
        self._file, self._plan = file, study_of(file)

    @classmethod
    def from_file(cls, path: str | PathLike[str], *, most_runs: int = MOST_RUNS) -> "Study":
        """Return the study of a TOML file.

        Parameters
        ----------
        path : str or path
        most_runs : int
            A file that asks for more is refused, before anything is made.

        Raises
        ------
        ParameterError, ParameterTypeError, UnknownNameError
            If the file cannot be read, or something in it is wrong: said with its line.
        """
        return cls._made(read_study_file(check_path("path", path)), most_runs)

    @classmethod
    def from_text(cls, text: str, *, most_runs: int = MOST_RUNS) -> "Study":
        """Return the study of what would stand in a file; otherwise as `from_file`."""
        return cls._made(parse_study_file(text), most_runs)

    @classmethod
    def from_folder(cls, folder: str | PathLike[str], *, most_runs: int = MOST_RUNS) -> "Study":
        """Return the study that was run into a folder, by the copy of its file there; otherwise as `from_file`."""
        return cls._made(kept_file(check_path("folder", folder)), most_runs)

    @classmethod
    def _made(cls, file: StudyFile, most_runs: int) -> "Study":
        if file.n_runs > check_int("most_runs", most_runs, 0):
            raise ParameterError(f"{many_runs(file)}: pass most_runs={file.n_runs} where that is meant")
        return cls(file)

    def __repr__(self) -> str:
        parts = counted(len(self.problems), "problem"), counted(len(self.variants), "variant")
        return f"Study of {', '.join(parts)} and {counted(self.n_runs, 'run')}"

    @property
    def problems(self) -> tuple[str, ...]:
        """The problems' names."""
        return tuple(scenario.name for scenario in self._plan.scenarios)

    @property
    def variants(self) -> tuple[str, ...]:
        """The names of the variants, each of which plays every problem, and of the controls."""
        return tuple(dict.fromkeys(one.name for scenario in self._plan.scenarios for one in scenario.variants))

    @property
    def n_runs(self) -> int:
        """Number of runs in all, those of controls among them."""
        return self._plan.n_runs

    def run(
        self,
        folder: str | PathLike[str],
        *,
        workers: int | None = None,
        cluster: str | None = None,
        overwrite: bool = False,
        accept_code: bool = False,
        runs: int | None = None,
        progress: bool = False,
    ) -> StudyTables:
        """Play what is missing in a folder; what is finished there is not played again.

        An interrupt keeps every finished run: calling again goes on from there.

        Parameters
        ----------
        folder : str or path
            Made if it is missing; it gets a copy of the study's file.
        workers : int, optional
            Processes. Default: one for each core. They change nothing but the time.
        cluster : str, optional
            The address of a Dask scheduler, such as ``"tcp://host:8786"``, whose workers play the runs instead, to the
            same bytes. Needs ``tuckerl[cluster]``.
        overwrite : bool
            Whether another study may take the place of that in the folder, and runs that other code has played be
            played again.
        accept_code : bool
            Whether runs that other code, or other versions, have played are kept.
        runs : int, optional
            Only so many runs of each variant for now, where it has more.
        progress : bool
            Whether to show, on standard error, how far it is: with each variant's mean so far on a terminal, a line
            every half minute elsewhere.

        Returns
        -------
        StudyTables
            Polars frames: ``runs`` has a row for each run, agent and episode.

        Raises
        ------
        ParameterError, ParameterTypeError
            If a number is impossible, or both `workers` and `cluster` are given.
        OutputError, OutputConflictError
            If the folder cannot be written, or holds another study's results, or runs of other code, and nothing says
            what to do with them.
        MissingExtraError, WorkerError
            If the cluster cannot be reached, or no worker can play the study.
        """
        folder = check_path("folder", folder)
        overwrite, shown = check_flag("overwrite", overwrite), check_flag("progress", progress)
        accept_code = check_flag("accept_code", accept_code)
        with runs_shown("runs") if shown else nullcontext() as show:
            return play_study(
                self._file,
                self._plan,
                folder,
                workers=workers,
                cluster=cluster,
                overwrite=overwrite,
                accept_code=accept_code,
                runs=runs,
                progress=show,
            )

    def status(self, folder: str | PathLike[str]) -> StudyStatus:
        """Return how far the study is in a folder: runs in all, finished, diverged, and means so far.

        It only looks, also while another process plays there.

        Raises
        ------
        OutputError
            If the folder cannot be read.
        """
        folder = check_path("folder", folder)
        is_begun = is_file(folder / FILE)
        kept = kept_runs(self._plan, folder) if is_begun else NOTHING_KEPT
        return status_of(self._plan, kept, reached_of(self._plan, kept.tables))

    def report(self, folder: str | PathLike[str]) -> StudyReport:
        """Write ``report.html``, its figures and ``comparisons.json``, of all runs that are finished.

        Raises
        ------
        ParameterError
            If nothing of the study was run into the folder.
        OutputError
            If it cannot be read or written.
        """
        folder = check_path("folder", folder)
        kept, remembered = self._kept(folder), Remembered(folder)
        reached = reached_of(self._plan, kept.tables)
        results = summarise_study(self._plan, reached, remembered)
        remembered.write()
        page = write_study(self._file, self._plan, results, status_of(self._plan, kept, reached), folder)
        return StudyReport(page, outcomes_of(results))

    def export(
        self, folder: str | PathLike[str], out: str | PathLike[str] | None = None, form: str | None = None
    ) -> Path:
        """Write a row for each finished run, agent and episode to one file; return its path.

        Parameters
        ----------
        folder : str or path
        out : str or path, optional
            The file. Default: ``export.csv`` or ``export.parquet`` in the folder.
        form : str, optional
            ``"csv"`` or ``"parquet"``. Default: what the file's name ends in, or CSV.

        Raises
        ------
        ParameterError, UnknownNameError
            If nothing of the study was run into the folder, or there is no such format.
        OutputError
            If the file cannot be written.
        """
        folder = check_path("folder", folder)
        path = None if out is None else check_path("out", out)
        form = export_format(path, form)
        varied = (axis.name for entry in self._file.algorithms for axis in entry.grid)
        frame = exported(self._plan, self._kept(folder).tables, varied)
        path = folder / f"export.{form}" if path is None else path
        make_folder(path.parent, "choose another file")
        write_whole(path, _bytes_of(frame, form))
        return path

    def _kept(self, folder: Path) -> KeptRuns:
        if not is_file(folder / FILE):
            kept_file(folder)  # says what is missing
        return kept_runs(self._plan, folder)


def many_runs(file: StudyFile) -> str:
    """Return how many runs a file asks for, in words."""
    return (
        f"{file.place.file} asks for {counted(file.n_runs, 'run')}: {counted(file.n_variants, 'variant')} on "
        f"{counted(len(file.problems), 'problem')}"
    )


def _bytes_of(frame: pl.DataFrame, form: str) -> bytes:
    buffer = io.BytesIO()
    if form == "csv":
        frame.write_csv(buffer)
    else:
        frame.write_parquet(buffer)
    return buffer.getvalue()
