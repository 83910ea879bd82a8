"""The report's page: what the template shows, worked out and formatted."""

import math
from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any, NamedTuple

from markupsafe import Markup

from tuckerl.reports import text as wording
from tuckerl.reports.ablation_text import gain_rows, what_works, without_the_step
from tuckerl.reports.markup import on_page, rendered, versions
from tuckerl.reports.picture import Shown
from tuckerl.reports.tables import MARKS, assumption_rows, cell_rows
from tuckerl.studies.ablation import Ablation
from tuckerl.studies.claims import Claim
from tuckerl.studies.paper import SCENARIOS, paper_study
from tuckerl.studies.sensitivity import Cell
from tuckerl.studies.statistics import CONFIDENCE, MEASURES, N_RESAMPLES
from tuckerl.studies.study import Scenario, Study, Variant
from tuckerl.studies.summary import Curve, Summary

_LIBRARIES = ("numpy", "scipy", "numba", "polars", "matplotlib", "plotly")
_VERDICTS = {
    "holds": ("holds", "hold"),
    "does not hold": ("does not hold", "do not hold"),
    "not decided": ("is not decided", "are not decided"),
}


class Extras(NamedTuple):
    """What the page can show beside the scenarios themselves."""

    gains: Sequence[Ablation] = ()
    cells: Sequence[Cell] = ()
    sensitivity: Shown | None = None


NO_EXTRAS = Extras()


def render_page(
    study: Study,
    claims: Sequence[Claim],
    summaries: Sequence[Summary],
    shown: Mapping[str, Sequence[Shown]],
    extras: Extras = NO_EXTRAS,
) -> str:
    """Return the page, with everything it needs inside it; `shown` holds the figures by scenario."""
    gains = {gain.scenario.name: gain for gain in extras.gains}
    scenarios = [_scenario(summary, shown.get(summary.scenario.name, ()), gains) for summary in summaries]
    interactive = any(figure["plotly"] for scenario in scenarios for figure in scenario["figures"])
    return rendered(
        "template.html",
        claims=[_claim(study, claim) for claim in claims],
        outcome=outcome(claims),
        marks=MARKS,
        assumptions=assumption_rows(study),
        scenarios=scenarios,
        cells=cell_rows(extras.cells),
        sensitivity=on_page(extras.sensitivity) if extras.sensitivity else None,
        seed=study.seed,
        commands=commands(study, with_cells=bool(extras.cells)),
        versions=versions(*_LIBRARIES),
        plotly_js=_plotly_js() if interactive else "",
        confidence=round(100 * CONFIDENCE),
        resamples=N_RESAMPLES,
    )


def outcome(claims: Sequence[Claim]) -> str:
    """Return what became of all claims in two sentences."""
    counts = [(sum(claim.verdict == verdict for claim in claims), verdict) for verdict in _VERDICTS]
    parts = [f"{count} {_conjugated(verdict, count)}" for count, verdict in counts if count]
    compared = [claim for claim in claims if not math.isnan(claim.control.mean)]
    text = f"Of {wording.counted(len(claims), 'claim')}, {', '.join(parts)}." if claims else "No claim was tested."
    if not compared:
        return text
    better = sum(claim.control.low > 0 for claim in compared)
    return (
        f"{text} In {better} of {wording.counted(len(compared), 'comparison')} the whole interval of the difference "
        "from the constant control, which lowers the learning rate as much without the tensor, is above 0."
    )


def commands(study: Study, *, with_cells: bool = False) -> list[str]:
    """Return the shortest command lines that run the study again: one, if one can say it all, or one a scenario."""
    name = study.scenarios[0].name if len(study.scenarios) == 1 else "all"
    first = study.scenarios[0]
    numbers = {"runs": first.n_runs, "episodes": first.n_episodes}
    wanted = study.specification()
    for kept, quick in product(((), ("runs",), ("episodes",), ("runs", "episodes")), (False, True)):
        chosen = {option: numbers[option] for option in kept}
        made = paper_study(name, seed=study.seed, quick=quick, **chosen) if name in (*SCENARIOS, "all") else None
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


def _conjugated(verdict: str, count: int) -> str:
    one, many = _VERDICTS[verdict]
    return one if count == 1 else many


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
        "reading": wording.reading(claim, comparison, scenario),
        "difference": wording.shown(claim.difference),
        "control": wording.shown(claim.control),
        "runs": f"{claim.runs:,}" if compared else wording.counted(claim.runs, "run"),
        "diverged": _diverged(claim) if compared or claim.difference.n_diverged else wording.NOTHING,
        "detail": claim.detail,
    }


def _diverged(claim: Claim) -> str:
    own, control = claim.difference.n_diverged, claim.control.n_diverged
    return f"{own:,}" if own == control else f"{own:,} (control: {control:,})"


def _scenario(summary: Summary, shown: Sequence[Shown], gains: Mapping[str, Ablation]) -> dict[str, Any]:
    scenario = summary.scenario
    curves = {curve.variant: curve for curve in summary.curves}
    return {
        "name": scenario.name,
        "title": scenario.title,
        "n_instances": scenario.n_instances,
        "n_runs": scenario.n_runs,
        "n_episodes": scenario.n_episodes,
        "base": scenario.variants[0].name,
        "settings": _settings(scenario),
        "variants": [_variant(variant, curves.get(variant.name), summary) for variant in scenario.variants],
        "best": "Longest" if MEASURES[scenario.measure].larger_is_better else "Shortest",
        "figures": [on_page(one) for one in shown if one.name != f"gain-{scenario.name}"],
        "gain": _gain(gains.get(scenario.name), [one for one in shown if one.name == f"gain-{scenario.name}"]),
    }


def _gain(gain: Ablation | None, shown: Sequence[Shown]) -> dict[str, Any] | None:
    if gain is None:
        return None
    return {
        "base": gain.scenario.family.base,
        "rows": gain_rows(gain),
        "what_works": what_works(gain),
        "without": without_the_step(gain),
        "figures": [on_page(one) for one in shown],
    }


def _variant(variant: Variant, curve: Curve | None, summary: Summary) -> dict[str, Any]:
    nothing = [math.nan] * 3
    total = nothing if curve is None else [float(values[-1]) for values in curve.band]
    against = nothing if curve is None else [float(values[-1]) for values in curve.against_base]
    is_base = variant.name == summary.scenario.variants[0].name
    return {
        "name": variant.name,
        "described": wording.described(variant),
        "agents": variant.n_agents,
        "best": wording.tenths(_known(summary.best_episodes.get(variant.name))),
        "total": wording.whole(total[0]),
        "total_interval": wording.interval(total[1], total[2]),
        "against": wording.NOTHING if is_base else wording.whole(against[0]),
        "against_interval": "" if is_base else wording.interval(against[1], against[2]),
        "seconds": wording.seconds(_known(summary.seconds.get(variant.name))),
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
