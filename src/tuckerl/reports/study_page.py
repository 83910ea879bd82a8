"""The report of a study from a file: a figure for each problem, ``comparisons.json`` and one page."""

import shlex
from collections import Counter
from pathlib import Path

from tuckerl.reports.comparison_text import outcome_in_study
from tuckerl.reports.figure import draw_figures
from tuckerl.reports.figures import FIGURES
from tuckerl.reports.page import write_page
from tuckerl.reports.text import counted, joined
from tuckerl.studies.comparison_result import VERDICTS
from tuckerl.studies.study import Study
from tuckerl.studies.study_file import StudyFile
from tuckerl.studies.study_folder import FILE, StudyStatus
from tuckerl.studies.study_result import ProblemResult

MOST_SENTENCES = 12
"""Comparisons of a problem that are put in words, too: of more, a table tells quicker."""


def write_study(file: StudyFile, study: Study, results: list[ProblemResult], status: StudyStatus, folder: Path) -> Path:
    """Write ``figures/curves-*.svg`` and ``.png``, ``comparisons.json`` and ``report.html``; return the page's path.

    Parameters
    ----------
    file : StudyFile
    study : Study
        Of the file.
    results : list of ProblemResult
        As :func:`tuckerl.studies.study_result.summarise_study` gives them.
    status : StudyStatus
    folder : Path
        Made if it is missing. Each file is written whole or not at all, the page last.

    Raises
    ------
    OutputError
        If the folder cannot be made or written.
    """
    figures = [draw_figures(FIGURES, result) for result in results]
    return write_page(
        folder,
        "study.html",
        [figure for own in figures for figure in own],
        numbers=("comparisons.json", [result.to_dict() for result in results]),
        title=file.title,
        outcome=outcome(results, status),
        problems=list(zip(results, figures, strict=True)),
        status=status,
        seed=study.seed,
        text=file.text,
        file=FILE,
        commands=[shlex.join(["tuckerl", "study", "run", FILE])],
        outcome_in_study=outcome_in_study,
        most_sentences=MOST_SENTENCES,
        zip=zip,
    )


def outcome(results: list[ProblemResult], status: StudyStatus) -> str:
    """Return what became of all comparisons, and whether runs are missing, in two or three sentences."""
    verdicts = Counter(compared.verdict for result in results for compared in result.comparisons)
    parts = [f"{verdicts[verdict]} {verdict}" for verdict in VERDICTS.values() if verdicts[verdict]]
    many = counted(verdicts.total(), "comparison")
    words = f"Of {many}, the candidate is {joined(parts)}." if parts else "Nothing was compared."
    missing = status.n_runs - status.n_finished
    if missing:
        words += f" {counted(missing, 'run')} of {status.n_runs:,} {'is' if missing == 1 else 'are'} not finished yet."
    if status.n_diverged:
        words += f" {counted(status.n_diverged, 'run')} diverged."
    return " ".join([words, *troubles(status)])


def troubles(status: StudyStatus) -> list[str]:
    """Return what of a study failed or was left out, in sentences."""
    words = []
    if status.n_failed:
        words.append(
            f"{counted(status.n_failed, 'run')} ended with an error: the tracebacks are in the folder's failures/, and "
            "`tuckerl study resume` plays them again."
        )
    if status.n_of_other_code:
        words.append(
            f"{counted(status.n_of_other_code, 'finished run')} left out, as other code has played them: `tuckerl "
            "study resume` says what has changed, and with --accept-code keeps them."
        )
    return words


def outcomes_of(results: list[ProblemResult]) -> tuple[str, ...]:
    """Return what came out of each comparison in sentences, with its problem where there are several."""
    return tuple(
        f"{result.scenario.name}: {outcome_in_study(compared)}" if len(results) > 1 else outcome_in_study(compared)
        for result in results
        for compared in result.comparisons
    )
