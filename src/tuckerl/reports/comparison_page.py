"""The report of a comparison: its figure, ``compare.json`` and one page that needs nothing but itself."""

import re
import shlex
from pathlib import Path

from tuckerl.reports.comparison_text import experience_of, outcome_of, regrets_of
from tuckerl.reports.figure import draw_figures
from tuckerl.reports.figures import FIGURES
from tuckerl.reports.page import write_page
from tuckerl.studies.comparison import N_EPISODES, N_RUNS, ComparisonConfig
from tuckerl.studies.comparison_result import ComparisonResult

_CONSTANTS = ("true", "false", "none", "null")  # words that are read as something else


def write_comparison(result: ComparisonResult, folder: Path) -> Path:
    """Write ``figures/compare.svg`` and ``.png``, ``compare.json`` and ``report.html``; return the page's path.

    Parameters
    ----------
    result : ComparisonResult
    folder : Path
        Made if it is missing. Each file is written whole or not at all, the page last.

    Raises
    ------
    OutputError
        If the folder cannot be made or written.
    """
    study, figures = result.study, draw_figures(FIGURES, result)
    return write_page(
        folder,
        "comparison.html",
        figures,
        numbers=("compare.json", result.to_dict()),
        title=study.scenario.title,
        outcome=outcome(result),
        result=result,
        study=study,
        variants=list(zip(study.scenario.variants, result.estimates, strict=True)),
        regrets=regrets_of(result.regrets),
        figures=figures,
        command=command(study.config),
    )


def command(config: ComparisonConfig) -> str:
    """Return the command line that makes the comparison again."""
    parts = ["tuckerl", "compare", config.base, config.candidate, "--env", config.environment]
    for name, value in config.keywords.items():
        parts += ["--env-set", f"{name}={literal(value)}"]
    for name, value in config.settings.items():
        parts += ["--set", f"{name}={literal(value)}"]
    numbers = {"runs": (config.n_runs, N_RUNS), "episodes": (config.n_episodes, N_EPISODES)}
    for option, (number, default) in numbers.items():
        parts += [] if number == default else [f"--{option}", str(number)]
    parts += [] if config.n_agents is None else ["--agents", str(config.n_agents)]
    parts += ["--equal-experience"] if config.equal_experience else []
    parts += [] if config.measure == "return" else ["--measure", config.measure]
    return shlex.join([*parts, "--seed", str(config.seed)])


def literal(value: object) -> str:
    """Return how a value is written on the command line: words as they are, all else as Python writes it."""
    if isinstance(value, str) and re.fullmatch(r"[A-Za-z_][\w.-]*", value) and value.lower() not in _CONSTANTS:
        return value
    return repr(value)


def outcome(result: ComparisonResult) -> str:
    """Return the result in two or three sentences, with one on experience where that is not equal by itself."""
    experience = experience_of(result.compared, result.study.config.n_episodes)
    return f"{outcome_of(result.compared)} {experience}".rstrip()
