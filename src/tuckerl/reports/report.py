"""A study's report: figures, ``claims.json`` and one page that needs nothing but itself."""

import math
from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Any

from markupsafe import Markup

from tuckerl.intervals import CONFIDENCE, N_RESAMPLES
from tuckerl.reports.ablation_text import ablation_rows, what_works, without_the_step
from tuckerl.reports.figure import RenderedFigure, draw_figures
from tuckerl.reports.figures import FIGURES
from tuckerl.reports.markup import on_page, rendered, versions, write_page
from tuckerl.reports.report_text import described, outcome, reading
from tuckerl.reports.tables import MARKS, assumption_rows, cell_rows
from tuckerl.reports.text import (
    NOTHING,
    amount_cell,
    counted,
    interval,
    measured,
    measured_interval,
    seconds,
    tenths,
    whole,
)
from tuckerl.studies.ablation import Ablation
from tuckerl.studies.claims import Claim
from tuckerl.studies.scenarios import SCENARIOS, scenario_study
from tuckerl.studies.sensitivity import Sensitivity
from tuckerl.studies.study import Scenario, Study, Variant
from tuckerl.studies.summary import Curve, Summary

_LIBRARIES = ("numpy", "scipy", "numba", "polars", "matplotlib", "plotly")
_NO_CELLS = Sensitivity()


def write_report(
    study: Study,
    claims: Sequence[Claim],
    summaries: Sequence[Summary],
    folder: Path,
    *,
    ablations: Sequence[Ablation] = (),
    sensitivity: Sensitivity = _NO_CELLS,
) -> Path:
    """Write ``figures/*.svg`` and ``*.png``, ``claims.json`` and ``report.html`` and return the page's path.

    Parameters
    ----------
    study : Study
    claims : sequence of Claim
    summaries : sequence of Summary
        One for each of the study's scenarios, as :func:`tuckerl.studies.summary.summarise` gives them.
    folder : Path
        Made if it is missing. Each file is written whole or not at all, the page last.
    ablations : sequence of Ablation
        Where the scenarios' gains come from, as :func:`tuckerl.studies.ablation.ablations` says.
    sensitivity : Sensitivity
        The claims under other readings of the paper, of :func:`tuckerl.studies.sensitivity.summarise_sensitivity`.

    Raises
    ------
    OutputError
        If the folder cannot be made or written.
    """
    own = [draw_figures(FIGURES, summary) for summary in summaries]
    taken_apart = {one.scenario.name: (one, draw_figures(FIGURES, one)) for one in ablations}
    of_cells = draw_figures(FIGURES, sensitivity)
    scenarios = [
        _scenario(summary, figures, taken_apart.get(summary.scenario.name))
        for summary, figures in zip(summaries, own, strict=True)
    ]
    interactive = any(figure["plotly"] for scenario in scenarios for figure in scenario["figures"])
    page = rendered(
        "report.html",
        claims=[_claim(study, claim) for claim in claims],
        outcome=outcome(claims),
        marks=MARKS,
        assumptions=assumption_rows(study),
        scenarios=scenarios,
        cells=cell_rows(sensitivity),
        sensitivity=on_page(of_cells),
        seed=study.seed,
        commands=commands(study, with_cells=bool(sensitivity.cells)),
        versions=versions(*_LIBRARIES),
        plotly_js=_plotly_js() if interactive else "",
        confidence=round(100 * CONFIDENCE),
        resamples=N_RESAMPLES,
    )
    figures = [
        *(one for some in own for one in some),
        *(f for _, some in taken_apart.values() for f in some),
        *of_cells,
    ]
    return write_page(folder, "report.html", page, figures, ("claims.json", [claim.to_dict() for claim in claims]))


def commands(study: Study, *, with_cells: bool = False) -> list[str]:
    """Return the shortest command lines that run the study again: one, if one can say it all, or one a scenario."""
    name = study.scenarios[0].name if len(study.scenarios) == 1 else "all"
    first = study.scenarios[0]
    numbers = {"runs": first.n_runs, "episodes": first.n_episodes}
    wanted = study.specification()
    for kept, quick in product(((), ("runs",), ("episodes",), ("runs", "episodes")), (False, True)):
        chosen = {option: numbers[option] for option in kept}
        made = scenario_study(name, seed=study.seed, quick=quick, **chosen) if name in (*SCENARIOS, "all") else None
        if made is not None and made.specification() == wanted:
            return [_command(name, quick, chosen, study.seed, with_cells)]
    parts = []
    for scenario in study.scenarios:
        paper = SCENARIOS.get(scenario.name)
        quick = paper is not None and scenario.n_instances != paper.n_instances
        numbers = {"runs": scenario.n_runs, "episodes": scenario.n_episodes}
        parts.append(_command(scenario.name, quick, numbers, study.seed, with_cells))
    return parts


def _command(name: str, quick: bool, numbers: Mapping[str, int], seed: int, with_cells: bool) -> str:
    options = [
        *(["--quick"] if quick else []),
        *(f"--{option} {number}" for option, number in numbers.items()),
        f"--seed {seed}",
        *(["--sensitivity"] if with_cells else []),
    ]
    return f"tuckerl reproduce {name} {' '.join(options)}"


def _claim(study: Study, claim: Claim) -> dict[str, Any]:
    scenario = next((s for s in study.scenarios if s.name == claim.scenario), None)
    comparisons = scenario.comparisons if scenario else ()
    comparison = next((c for c in comparisons if c.id == claim.id), None)
    compared = not math.isnan(claim.difference.mean)
    return {
        "id": claim.id,
        "claim": claim.claim,
        "verdict": claim.verdict,
        "mark": claim.verdict.replace(" ", "-"),
        "reading": reading(claim, comparison, scenario),
        "difference": amount_cell(claim.difference),
        "control": amount_cell(claim.control),
        "runs": f"{claim.runs:,}" if compared else counted(claim.runs, "run"),
        "diverged": _diverged(claim) if compared or claim.difference.n_diverged else NOTHING,
        "detail": claim.detail,
    }


def _diverged(claim: Claim) -> str:
    own, control = claim.difference.n_diverged, claim.control.n_diverged
    return f"{own:,}" if own == control else f"{own:,} (control: {control:,})"


def _scenario(
    summary: Summary, figures: Sequence[RenderedFigure], ablation: tuple[Ablation, Sequence[RenderedFigure]] | None
) -> dict[str, Any]:
    scenario, measure = summary.scenario, summary.measure
    curves = {curve.variant: curve for curve in summary.curves}
    best = ("Longest" if measure.larger_is_better else "Shortest") if measure.column == "steps" else "Best"
    return {
        "name": scenario.name,
        "title": scenario.title,
        "n_instances": scenario.n_instances,
        "n_runs": scenario.n_runs,
        "n_episodes": scenario.n_episodes,
        "base": scenario.variants[0].name,
        "settings": _settings(scenario),
        "variants": [_variant(variant, curves.get(variant.name), summary) for variant in scenario.variants],
        "best": best,
        "column": measure.column,
        "figures": on_page(figures),
        "ablation": None if ablation is None else _ablation(*ablation),
    }


def _ablation(ablation: Ablation, figures: Sequence[RenderedFigure]) -> dict[str, Any]:
    return {
        "base": ablation.scenario.algorithm.base,
        "rows": ablation_rows(ablation),
        "what_works": what_works(ablation),
        "without": without_the_step(ablation),
        "figures": on_page(figures),
    }


def _variant(variant: Variant, curve: Curve | None, summary: Summary) -> dict[str, Any]:
    nothing = [math.nan] * 3
    total = nothing if curve is None else [float(values[-1]) for values in curve.band]
    against = nothing if curve is None else [float(values[-1]) for values in curve.against_base]
    is_base = variant.name == summary.scenario.variants[0].name
    in_steps = summary.measure.column == "steps"
    words, words_of_interval = (whole, interval) if in_steps else (measured, measured_interval)
    best = _known(summary.best_episodes.get(variant.name))
    return {
        "name": variant.name,
        "described": described(variant),
        "agents": variant.n_agents,
        "best": tenths(best) if in_steps else measured(best),
        "total": words(total[0]),
        "total_interval": words_of_interval(total[1], total[2]),
        "against": NOTHING if is_base else words(against[0]),
        "against_interval": "" if is_base else words_of_interval(against[1], against[2]),
        "seconds": seconds(_known(summary.seconds.get(variant.name))),
        "runs": f"{curve.n_runs:,}" if curve else "0",
        "diverged": f"{curve.n_diverged:,}" if curve else "0",
    }


def _known(value: float | None) -> float:
    # A variant all of whose runs diverged at once has no shortest episode.
    return math.nan if value is None else value


def _settings(scenario: Scenario) -> str:
    """Return the learner's and the tensor step's parameters as in the first variants that have them."""
    parameters = [f"{name} {value}" for name, value in scenario.variants[0].parameters.items()]
    step = next((variant.tensor_step for variant in scenario.variants if variant.tensor_step), None)
    if step is not None:
        parameters.append(f"tensor step every {step.every} episodes with ranks {step.ranks}")
    return ", ".join(parameters)


def _plotly_js() -> Markup:
    # Imported here: only a page with interactive figures pays for it.
    from plotly.offline import get_plotlyjs

    return Markup(get_plotlyjs())  # noqa: S704  # a script of the installed package; it holds no </script
