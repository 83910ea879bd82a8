"""Pages of studies that are being played: of the runs that are finished, read beside whoever writes.

A page is written into a folder of its own: the study's folder is only looked at, and nobody's lock is taken.
"""

import json
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import polars as pl

from tuckerl.errors import ParameterError
from tuckerl.files import is_file
from tuckerl.reports.comparison_page import write_comparison
from tuckerl.reports.page import write_page
from tuckerl.reports.report import write_report
from tuckerl.reports.study_page import write_study
from tuckerl.reports.text import counted
from tuckerl.studies.comparison import ComparisonConfig, comparison_study
from tuckerl.studies.comparison_result import summarise_comparison
from tuckerl.studies.estimates import reached_of
from tuckerl.studies.remembered import Remembered
from tuckerl.studies.scenarios import SCENARIOS
from tuckerl.studies.study import Scenario, Study
from tuckerl.studies.study_differences import changes_of_study, study_specification
from tuckerl.studies.study_folder import FILE, KeptRuns, kept_file, kept_runs, status_of
from tuckerl.studies.study_making import study_of
from tuckerl.studies.study_result import summarise_study
from tuckerl.studies.summary import summarise
from tuckerl.studies.tables import StudyTables

STUDY, REQUEST = "study.json", "request.json"

WritePage = Callable[[Path], Path]
"""Writes the page of what is finished into a folder, or one that says why nothing is shown yet; returns its path."""


def page_of(folder: Path, config_of: Callable[[Any], ComparisonConfig]) -> WritePage:
    """Return what writes the page of a study's folder.

    Parameters
    ----------
    folder : Path
        Of ``tuckerl study run``, ``reproduce`` or ``compare``; it may hold no finished run yet.
    config_of : callable
        What reads the ``request.json`` that ``tuckerl compare`` leaves.

    Raises
    ------
    ParameterError
        If the folder holds no study, or one of an older version, or another that there is no such page for.
    """
    if is_file(folder / FILE):
        kept_file(folder)  # says what is wrong in it
        return lambda out: _of_file(folder, out)
    held = _held(folder)
    if is_file(folder / REQUEST):
        comparison = comparison_study(_config(folder, config_of))
        _check_same(folder, held, comparison.study)

        def of_comparison(out: Path) -> Path:
            study, tables, why = _whole_rounds(comparison.study, folder)
            if not study.scenarios:
                return write_waiting(why, out)
            return write_comparison(summarise_comparison(comparison._replace(study=study), tables), out)

        return of_comparison
    scenarios = held.get("scenarios", {})
    if not scenarios.keys() <= SCENARIOS.keys():
        raise ParameterError(
            f"{folder} holds a study of {', '.join(scenarios)}, but neither {FILE} nor {REQUEST}, from which its page "
            "is made: give the command again that made it, for an older version left this out (tune never has it)"
        )
    study = Study(tuple(_resized(SCENARIOS[name], own) for name, own in scenarios.items()), held.get("seed", 0))
    _check_same(folder, held, study)
    return lambda out: _of_scenarios(study, folder, out)


def _held(folder: Path) -> dict[str, Any]:
    """Return what a folder says of its study."""
    if is_file(folder):
        raise ParameterError(f"{folder} is a file: name the folder that its study is run into, as `--out` gave it")
    if not folder.is_dir():
        raise ParameterError(f"there is no folder {folder}: name that of a `study run`, a `reproduce` or a `compare`")
    if not is_file(folder / STUDY):
        raise ParameterError(
            f"{folder} holds no study, as neither {FILE} nor {STUDY} is in it: name the folder of a `study run`, a "
            "`reproduce` or a `compare`"
        )
    return _read(folder / STUDY)


def _read(path: Path) -> dict[str, Any]:
    try:
        content = json.loads(path.read_bytes())
    except (OSError, ValueError) as error:
        raise ParameterError(f"cannot read {path}: {error}") from error
    if not isinstance(content, dict):
        raise ParameterError(f"{path} must hold a JSON object, as tuckerl writes it")
    return content


def _config(folder: Path, config_of: Callable[[Any], ComparisonConfig]) -> ComparisonConfig:
    try:
        return config_of(_read(folder / REQUEST))
    except (KeyError, TypeError) as error:
        raise ParameterError(
            f"{folder / REQUEST} lacks something: give the `tuckerl compare` again that made it, which writes it anew"
        ) from error


def _resized(scenario: Scenario, numbers: dict[str, Any]) -> Scenario:
    return scenario.resized(*(numbers.get(name) for name in ("instances", "runs", "episodes")))


def _check_same(folder: Path, held: dict[str, Any], study: Study) -> None:
    """Refuse a folder whose study is not what is made of it now: its runs would not be found."""
    try:
        difference = next(changes_of_study(held, study_specification(study)), "")
    except (AttributeError, TypeError, KeyError):
        difference = f"its {STUDY} lacks something"
    if difference:
        raise ParameterError(
            f"{folder} holds a study of another version of tuckerl, or a part of a reproduction ({difference}): name "
            "the folder of the whole, or open the report.html in it"
        )


def _of_file(folder: Path, out: Path) -> Path:
    file = kept_file(folder)  # anew each time: it may have grown
    study = study_of(file)
    kept, remembered = kept_runs(study, folder), Remembered(out)
    reached = reached_of(study, kept.tables)
    results = summarise_study(study, reached, remembered)
    remembered.write()
    return write_study(file, study, results, status_of(study, kept, reached), out)


def _of_scenarios(study: Study, folder: Path, out: Path) -> Path:
    whole, tables, why = _whole_rounds(study, folder)
    if not whole.scenarios:
        return write_waiting(why, out)
    claims, summaries = summarise(whole, tables)
    return write_report(whole, claims, summaries, out)


def _whole_rounds(study: Study, folder: Path) -> tuple[Study, StudyTables, str]:
    """Return a study of those runs alone that all variants have finished in all instances, and why there are none.

    Sums over instances, and differences between variants, are of whole rounds only. Scenarios without one are left out.
    """
    kept = kept_runs(study, folder)
    numbers = {one.name: _rounds(one, kept.tables.runs) for one in study.scenarios}
    chosen = tuple(replace(one, n_runs=len(numbers[one.name])) for one in study.scenarios if numbers[one.name])
    rounds = pl.DataFrame(
        [(name, number) for name, own in numbers.items() for number in own],
        {"scenario": pl.String, "run": pl.Int32},
        orient="row",
    )
    tables = StudyTables(
        *(one.join(rounds, on=["scenario", "run"], how="semi", maintain_order="left") for one in kept.tables)
    )
    return replace(study, scenarios=chosen), tables, "" if chosen else _why_nothing(kept)


def _rounds(scenario: Scenario, runs: pl.DataFrame) -> list[int]:
    """Return the numbers of the runs that are finished in all instances by all variants."""
    names = [variant.name for variant in scenario.variants]
    of_scenario = runs.filter((pl.col("scenario") == scenario.name) & pl.col("variant").is_in(names))
    finished = of_scenario.select("variant", "instance", "run").unique().group_by("run").len()
    return finished.filter(pl.col("len") == len(names) * scenario.n_instances)["run"].sort().to_list()


def _why_nothing(kept: KeptRuns) -> str:
    if kept.n_of_other_code:
        left_out = f"{counted(kept.n_of_other_code, 'finished run')} left out, as other code has played them"
        return f"{left_out}: the command that made the folder keeps them with --accept-code."
    failed = f" {counted(kept.n_failed, 'run')} ended with an error." if kept.n_failed else ""
    return f"No run is finished by all variants yet.{failed} This page shows the report as soon as one is."


def write_waiting(words: str, out: Path) -> Path:
    """Write a page that says, in the place of a report, why there is none yet; return its path."""
    return write_page(out, "waiting.html", [], name="waiting.html", title="A study", outcome="", words=words)


def stamp_of(folder: Path) -> tuple[object, ...]:
    """Return what changes when runs of a folder are finished or fail, or its study grows."""
    found = [folder / name for name in (FILE, STUDY, REQUEST)]
    found += sorted([*(folder / "parts").glob("*"), *(folder / "failures").glob("*")])
    return tuple(_state(path) for path in found)


def _state(path: Path) -> tuple[str, int, int] | None:
    with suppress(OSError):  # it has just been put together with others
        state = path.stat()
        return path.name, state.st_size, state.st_mtime_ns
    return None
