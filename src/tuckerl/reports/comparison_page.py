"""The report of a comparison: its figure, ``compare.json`` and one page that needs nothing but itself."""

import math
import re
import shlex
from pathlib import Path

from tuckerl.reports.figure import draw_figures
from tuckerl.reports.figures import FIGURES
from tuckerl.reports.markup import rendered, versions, write_page
from tuckerl.reports.report import described
from tuckerl.reports.text import all_pairs, amount, amount_interval, counted, joined, measured, ranks_of
from tuckerl.studies.comparison import N_EPISODES, N_RUNS, ComparisonConfig
from tuckerl.studies.comparison_result import VERDICTS, ComparisonResult
from tuckerl.studies.study import Variant

_LIBRARIES = ("numpy", "scipy", "numba", "gymnasium", "pettingzoo", "polars", "matplotlib")
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
    page = rendered(
        "comparison.html",
        title=study.scenario.title,
        outcome=outcome(result),
        result=result,
        study=study,
        variants=list(zip(study.scenario.variants, result.estimates, strict=True)),
        verdicts=VERDICTS,
        figures=figures,
        command=command(study.config),
        versions=versions(*_LIBRARIES),
        described=described,
        settings=settings,
    )
    return write_page(folder, "report.html", page, figures, ("compare.json", result.to_dict()))


def command(config: ComparisonConfig) -> str:
    """Return the command line that makes the comparison again."""
    parts = ["tuckerl", "compare", config.base, config.candidate, "--env", config.environment]
    for name, value in config.keywords.items():
        parts += ["--env-set", f"{name}={_literal(value)}"]
    for name, value in config.settings.items():
        parts += ["--set", f"{name}={_literal(value)}"]
    numbers = {"runs": (config.n_runs, N_RUNS), "episodes": (config.n_episodes, N_EPISODES)}
    for option, (number, default) in numbers.items():
        parts += [] if number == default else [f"--{option}", str(number)]
    parts += [] if config.n_agents is None else ["--agents", str(config.n_agents)]
    parts += [] if config.measure == "return" else ["--measure", config.measure]
    return shlex.join([*parts, "--seed", str(config.seed)])


def _literal(value: object) -> str:
    """Return how a value is written on the command line: words as they are, all else as Python writes it."""
    if isinstance(value, str) and re.fullmatch(r"[A-Za-z_][\w.-]*", value) and value.lower() not in _CONSTANTS:
        return value
    return repr(value)


def outcome(result: ComparisonResult) -> str:
    """Return the result in two or three sentences."""
    comparison, difference = result.study.comparison, result.difference
    base, candidate = comparison.base, comparison.candidate
    if math.isnan(difference.mean):
        return f"Nothing is left to compare: in {all_pairs(difference.n_diverged)} a run diverged."
    pairs = counted(difference.n_pairs, "pair")
    reached = " against ".join(measured(one.mean) for one in reversed(result.estimates[:2]))
    words = f"{result.measure.text} {reached}"
    by = f"{amount(difference)} {amount_interval(difference)}".strip()
    if result.verdict == "not decided":
        why = "one pair has no interval" if math.isnan(difference.low) else "the interval covers 0"
        first = (
            f"These runs do not decide between {candidate} and {base}: {words}, difference {by} over {pairs}; {why}."
        )
    else:
        first = f"{candidate} does {result.verdict} than {base}: {words}, difference {by} over {pairs}."
    return f"{first} {against_control(result)}".rstrip()


def against_control(result: ComparisonResult) -> str:
    """Return what the control says of the difference, or why there is none."""
    comparison, control = result.study.comparison, result.control
    if not comparison.control:
        return f"No control was played: {result.study.no_control}."
    if math.isnan(control.low):
        return f"There are too few pairs to compare it with the control, {comparison.control}."
    by = f"{amount(control)} {amount_interval(control)}"
    how = "better" if control.low > 0 else "worse" if control.high < 0 else "neither better nor worse"
    return f"{comparison.candidate} does {how} than the control, {comparison.control}: {by}. {_meaning(result)}"


def _meaning(result: ComparisonResult) -> str:
    """Say what may be concluded of a gain from the comparison with the control."""
    if not result.study.algorithm(result.study.comparison.candidate).is_t_version:
        return "That control is the base's own: it shows how far the base's weights matter."
    if result.verdict != "better":
        return ""
    shared = _shared(result)
    if result.control.low > 0:
        return f"So what the control has too, {shared}, does not explain all of the gain over the base."
    if result.control.high < 0:
        return "So the gain over the base is not the tensor's: with equal weights for all actions it is larger."
    return f"So what the control has too, {shared}, explains the gain over the base, as far as these runs can tell."


def _shared(result: ComparisonResult) -> str:
    """Return what the control shares with the candidate and not with the base."""
    base, candidate, *_ = result.study.scenario.variants
    parts = []
    if (base.learner, base.parameters) != (candidate.learner, candidate.parameters):
        parts.append("the algorithm and its parameters")
    if base.tensor_step is None:
        parts.append("the smaller learning rate")
    if candidate.n_agents != base.n_agents:
        parts.append("the sharing among its agents")
    return joined(parts) or "the tensor step with constant weights"


def settings(variant: Variant) -> str:
    """Return the parameters that a variant was given."""
    step = variant.tensor_step
    words = [f"{name} {value}" for name, value in variant.parameters.items()] or [
        "all parameters as they are by default"
    ]
    if step is not None:
        words.append(
            f"tensor step every {step.every} episodes with {ranks_of(step.ranks)}, weights {step.weights}, "
            f"share {step.share}, floor {step.floor:g}"
        )
    return "; ".join(words)
