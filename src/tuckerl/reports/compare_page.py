"""The page of a comparison: what its template shows, worked out and formatted."""

import re
import shlex

from tuckerl.reports import compare_text as words
from tuckerl.reports.markup import on_page, rendered, versions
from tuckerl.reports.picture import Shown
from tuckerl.studies.compare import N_EPISODES, N_RUNS, ComparisonConfig
from tuckerl.studies.compared import ComparisonResult
from tuckerl.studies.statistics import CONFIDENCE, MEASURES, N_RESAMPLES

_LIBRARIES = ("numpy", "scipy", "numba", "gymnasium", "pettingzoo", "polars", "matplotlib")
_CONSTANTS = ("true", "false", "none", "null")  # words that are read as something else


def comparison_page(compared: ComparisonResult, shown: Shown) -> str:
    """Return the page, with everything it needs inside it."""
    request, contest = compared.contest.request, compared.contest
    return rendered(
        "compare.html",
        title=contest.scenario.title,
        outcome=words.outcome(compared),
        comparison=contest.comparison,
        rows=words.difference_rows(compared),
        no_control=contest.no_control,
        relative=compared.difference.relative,
        measured=words.MEASURED[request.measure],
        larger_is_better=MEASURES[request.measure].larger_is_better,
        variants=words.variant_rows(compared),
        figure=on_page(shown),
        environment=contest.scenario.name,
        request=request,
        assumptions=contest.scenario.assumptions,
        command=command(request),
        versions=versions(*_LIBRARIES),
        confidence=round(100 * CONFIDENCE),
        resamples=N_RESAMPLES,
    )


def command(request: ComparisonConfig) -> str:
    """Return the command line that makes the comparison again."""
    parts = ["tuckerl", "compare", request.base, request.candidate, "--env", request.environment]
    for name, value in request.keywords.items():
        parts += ["--env-set", f"{name}={_literal(value)}"]
    for name, value in request.settings.items():
        parts += ["--set", f"{name}={_literal(value)}"]
    numbers = {"runs": (request.n_runs, N_RUNS), "episodes": (request.n_episodes, N_EPISODES)}
    for option, (number, default) in numbers.items():
        parts += [] if number == default else [f"--{option}", str(number)]
    parts += [] if request.n_agents is None else ["--agents", str(request.n_agents)]
    parts += [] if request.measure == "return" else ["--measure", request.measure]
    return shlex.join([*parts, "--seed", str(request.seed)])


def _literal(value: object) -> str:
    """Return how a value is written on the command line: words as they are, all else as Python writes it."""
    if isinstance(value, str) and re.fullmatch(r"[A-Za-z_][\w.-]*", value) and value.lower() not in _CONSTANTS:
        return value
    return repr(value)
