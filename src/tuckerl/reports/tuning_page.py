"""The report of a tuning: the test of the winner, ``tune.json`` and one page that needs nothing but itself."""

import math
import shlex
from pathlib import Path

from tuckerl.reports.comparison_page import literal
from tuckerl.reports.comparison_text import outcome_of
from tuckerl.reports.figure import draw_figures
from tuckerl.reports.figures import FIGURES
from tuckerl.reports.page import write_page
from tuckerl.studies.search_space import Range
from tuckerl.studies.tuning import Search, Trial, TuningConfig
from tuckerl.studies.tuning_folder import TuningResult, in_words_of_search


def write_tuning(result: TuningResult, folder: Path) -> Path:
    """Write a figure of the test, ``tune.json`` and ``report.html``; return the page's path.

    Parameters
    ----------
    result : TuningResult
    folder : Path
        Made if it is missing. Each file is written whole or not at all, the page last.

    Raises
    ------
    OutputError
        If the folder cannot be made or written.
    """
    figures = draw_figures(FIGURES, result.test)
    return write_page(
        folder,
        "tuning.html",
        figures,
        numbers=("tune.json", result.to_dict()),
        title=f"{result.tuned.searches[0].space.algorithm.title} tuned on {result.config.environment}",
        outcome=outcome(result),
        result=result,
        test=result.test,
        compared=result.compared,
        config=result.config,
        variants=list(zip(result.test.scenario.variants, result.test.estimates, strict=True)),
        figures=figures,
        command=command(result.config),
        ranked=ranked,
        told=in_words_of_search,
        isnan=math.isnan,
    )


def outcome(result: TuningResult) -> str:
    """Return the winner's settings and what its test came to, in some sentences."""
    return f"{settings_found(result)} {outcome_of(result.compared)}"


def settings_found(result: TuningResult) -> str:
    """Return which settings were found, of both algorithms."""
    found = [
        f"Of {len(one.trials)} trials of {one.space.algorithm.name}, {one.winner().name} was best"
        for one in result.tuned.searches
    ]
    return f"{'; of'.join([found[0], *(words.removeprefix('Of') for words in found[1:])])}. On fresh seeds:"


def ranked(search: Search) -> list[Trial]:
    """Return a search's trials: those that came furthest first, of these the best."""
    larger = 1.0 if search.larger_is_better else -1.0

    def place(trial: Trial) -> tuple[float, bool, float]:
        runs = max(trial.means)
        mean = trial.means[runs]
        return -runs, math.isnan(mean), 0.0 if math.isnan(mean) else -larger * mean

    return sorted(search.trials, key=place)


def command(config: TuningConfig) -> str:
    """Return the command line that makes the tuning again."""
    default, parts = TuningConfig("", ""), ["tuckerl", "tune", config.algorithm, config.environment]
    for name, value in config.keywords.items():
        parts += ["--env-set", f"{name}={literal(value)}"]
    for name, value in config.settings.items():
        parts += ["--set", f"{name}={literal(value)}"]
    for name, one in config.searched.items():
        values = in_words_of_search(one) if isinstance(one, Range) else ",".join(map(literal, one.values))
        parts += ["--search", f"{name}={values}"]
    numbers = {"trials": "n_trials", "batch": "batch", "runs": "n_runs", "episodes": "n_episodes", "agents": "n_agents"}
    for option, name in {**numbers, "measure": "measure"}.items():
        value = getattr(config, name)
        parts += [] if value == getattr(default, name) else [f"--{option}", str(value)]
    parts += [] if config.rungs == default.rungs else ["--rungs", ",".join(map(str, config.rungs))]
    return shlex.join([*parts, "--seed", str(config.seed)])
