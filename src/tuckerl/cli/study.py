"""``tuckerl study``: a study from a TOML file, run, looked at, resumed, reported and exported."""

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.table import Table
from rich.text import Text

from tuckerl.cli.options import AcceptCode, Cluster, OverwriteStudy, Workers, Yes

if TYPE_CHECKING:
    from tuckerl.reports.study import Study
    from tuckerl.studies.study_file import StudyFile
    from tuckerl.studies.study_folder import StudyStatus

study = typer.Typer(no_args_is_help=True, help="Run a study that a TOML file describes; look at it, report, export.")

File = Annotated[Path, typer.Argument(metavar="FILE", help="A study file, in TOML; docs/studies.md shows one.")]
Folder = Annotated[Path, typer.Argument(metavar="DIR", help="The folder that a study was run into.")]


@study.command("run")
def run_file(
    file: File,
    out: Annotated[Path | None, typer.Option(help="Folder for the results. Default: one in results/study.")] = None,
    workers: Workers = None,
    cluster: Cluster = None,
    runs: Annotated[
        int | None, typer.Option(help="Only so many runs of each variant for now; `resume` plays the rest.")
    ] = None,
    overwrite: OverwriteStudy = False,
    accept_code: AcceptCode = False,
    yes: Yes = False,
) -> None:
    """Play what a study file asks for; write report.html, figures, comparisons.json and runs.parquet.

    The file is checked whole before anything is played. Finished runs in the folder are not run again.
    """
    from tuckerl.studies.study_file import read_study_file

    made = _made(read_study_file(file), yes)
    folder = _folder_of(file) if out is None else out
    _play(made, folder, workers=workers, cluster=cluster, runs=runs, overwrite=overwrite, accept_code=accept_code)


@study.command()
def resume(
    folder: Folder,
    workers: Workers = None,
    cluster: Cluster = None,
    accept_code: AcceptCode = False,
    yes: Yes = False,
) -> None:
    """Play what is missing of the study in a folder, and write its report."""
    from tuckerl.studies.study_folder import kept_file

    _play(_made(kept_file(folder), yes), folder, workers=workers, cluster=cluster, accept_code=accept_code)


@study.command()
def status(
    place: Annotated[Path, typer.Argument(metavar="DIR|FILE", help="A study's folder, or a study file.")],
) -> None:
    """Say how far a study is, and what each variant has reached; of a file, check it, and say what it asks for.

    Of a folder of another command, such as tune, it says how many runs of what are finished. A table on a terminal;
    elsewhere a line each, its columns apart by tabs.
    """
    from tuckerl.files import is_file
    from tuckerl.reports.study import Study
    from tuckerl.reports.study_page import troubles
    from tuckerl.studies.study_file import read_study_file
    from tuckerl.studies.study_folder import FILE, kept_file

    is_of_file = is_file(place)
    if not is_of_file and is_file(place / "study.json") and not is_file(place / FILE):
        _show_folder(place)
        return
    made = Study(read_study_file(place) if is_of_file else kept_file(place))
    folder = _folder_of(place) if is_of_file else place
    found = made.status(folder)
    _show(found)
    for words in (repr(made), *troubles(found)):
        typer.echo(words, err=True)


@study.command()
def paper(
    scenario: Annotated[str, typer.Argument(help="cart-pole, dyna-maze or robot-rescue.")],
) -> None:
    """Print the study file of one of the paper's experiments, to be run, or changed into a study of your own."""
    from tuckerl.studies.planned import file_of

    typer.echo(file_of(scenario), nl=False)


@study.command()
def report(folder: Folder) -> None:
    """Write the report of a study's finished runs anew, without playing any."""
    from tuckerl.reports.study import Study
    from tuckerl.studies.study_folder import kept_file

    _report(Study(kept_file(folder)), folder)


@study.command()
def export(
    folder: Folder,
    form: Annotated[
        str | None, typer.Option("--format", help="csv or parquet. Default: what --out ends in, or csv.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="The file. Default: export.csv or .parquet in the folder.")] = None,
) -> None:
    """Write one table: a row for each run, agent and episode, with what grids varied."""
    from tuckerl.reports.study import Study
    from tuckerl.studies.study_folder import kept_file

    typer.echo(f"Table: {Study(kept_file(folder)).export(folder, out, form)}")


def _folder_of(file: Path) -> Path:
    return Path("results") / "study" / (re.sub(r"[^\w.-]+", "-", file.stem) or "study")


def _made(file: "StudyFile", yes: bool) -> "Study":
    """Return the study of a file; one that is very large is asked about first."""
    from tuckerl.cli.large import ask_if_large
    from tuckerl.reports.study import Study

    ask_if_large(file.n_runs, file.place.file, yes)
    return Study(file)


def _play(made: "Study", folder: Path, **how: Any) -> None:
    from tuckerl.cli.compiling import compiling_said
    from tuckerl.cli.warnings import short_warnings

    with compiling_said(), short_warnings():
        made.run(folder, progress=True, **how)
    _report(made, folder)


def _report(made: "Study", folder: Path) -> None:
    from tuckerl.reports.study_page import MOST_SENTENCES

    written = made.report(folder)
    for words in written.outcomes[:MOST_SENTENCES]:
        typer.echo(words)
    if len(written.outcomes) > MOST_SENTENCES:
        typer.echo(f"... and {len(written.outcomes) - MOST_SENTENCES:,} more comparisons, which the report shows")
    typer.echo(f"Report: {written.page}")


def _show_folder(folder: Path) -> None:
    """Say how far the results of another command are."""
    from tuckerl.studies.folder_status import folder_status
    from tuckerl.studies.tuning_folder import outcome_in

    found = folder_status(folder)
    rows = [[one.name, str(one.n_variants), f"{one.n_finished} of {one.n_runs}", str(one.n_failed)] for one in found]
    _show_rows(("Scenario", "Variants", "Runs", "Failed"), rows)
    for words in outcome_in(folder, [one.name for one in found]):
        typer.echo(words, err=True)


def _show(status: "StudyStatus") -> None:
    from tuckerl.reports.text import measured, measured_interval
    from tuckerl.studies.statistics import MEASURES

    measure = MEASURES[status.measure].text
    rows = [
        [
            one.problem,
            one.estimate.variant,
            f"{one.n_finished} of {one.n_runs}",
            str(one.estimate.n_diverged),
            f"{measured(one.estimate.mean)} {measured_interval(one.estimate.low, one.estimate.high)}".strip(),
        ]
        for one in status.variants
    ]
    _show_rows(("Problem", "Variant", "Runs", "Diverged", f"{measure.capitalize()} [95 % interval]"), rows)


def _show_rows(head: tuple[str, ...], rows: list[list[str]]) -> None:
    """Write a table on a terminal; elsewhere a line for each row, its columns apart by tabs."""
    console = Console()
    if not console.is_terminal:
        for row in rows:
            typer.echo("\t".join(row))
        return
    table = Table(*head)
    for row in rows:
        table.add_row(*map(Text, row))
    console.print(table)
