"""A study's report: figures, ``claims.json`` and one page that needs nothing but itself."""

import math
from collections.abc import Mapping, Sequence
from itertools import chain, product
from pathlib import Path

from tuckerl.reports.ablation import what_works, without_the_step
from tuckerl.reports.figure import RenderedFigure, draw_figures
from tuckerl.reports.figures import FIGURES
from tuckerl.reports.page import write_page
from tuckerl.reports.text import all_pairs, counted, ranks_of
from tuckerl.reports.verdicts import with_constant_weights
from tuckerl.studies.ablation import Ablation
from tuckerl.studies.assumptions import INFERRED, INVENTED, OVERRULED, Assumption
from tuckerl.studies.claims import IS_IT_THE_TENSOR, Claim
from tuckerl.studies.scenarios import SCENARIOS, scenario_study
from tuckerl.studies.sensitivity import Sensitivity
from tuckerl.studies.statistics import Difference
from tuckerl.studies.study import Comparison, Scenario, Study
from tuckerl.studies.summary import Summary

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
    figures = {summary.scenario.name: draw_figures(FIGURES, summary) for summary in summaries}
    of_ablations = [(ablation, draw_figures(FIGURES, ablation)) for ablation in ablations]
    of_cells = draw_figures(FIGURES, sensitivity)
    drawn = chain(*figures.values(), *(own for _, own in of_ablations), of_cells)
    return write_page(
        folder,
        "report.html",
        list(drawn),
        numbers=("claims.json", [claim.to_dict() for claim in claims]),
        claims=[(claim, reading(study, claim), figure_of(study, claim, figures)) for claim in claims],
        outcome=outcome(claims),
        is_it_the_tensor=IS_IT_THE_TENSOR,
        marks=MARKS,
        assumptions=assumed(study),
        summaries=summaries,
        figures=figures,
        ablations=of_ablations,
        sensitivity=sensitivity,
        sensitivity_figures=of_cells,
        seed=study.seed,
        commands=commands(study, with_cells=bool(sensitivity.cells)),
        settings=_settings,
        what_works=what_works,
        without_the_step=without_the_step,
    )


def figure_of(study: Study, claim: Claim, figures: Mapping[str, Sequence[RenderedFigure]]) -> RenderedFigure | None:
    """Return the figure that shows what a claim is about; None of one that no figure shows."""
    measures = {(s.name, c.id): c.measure for s in study.scenarios for c in s.comparisons}
    measure = measures.get((claim.scenario, claim.id))
    kind = "paths" if measure == "path" else "lines"
    own = figures.get(claim.scenario, ()) if measure else ()
    return next((figure for figure in own if figure.live and figure.live.kind == kind), None)


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


def _settings(scenario: Scenario) -> str:
    """Return the learner's and the tensor step's parameters as in the first variants that have them."""
    parameters = [f"{name} {value}" for name, value in scenario.variants[0].parameters.items()]
    step = next((variant.tensor_step for variant in scenario.variants if variant.tensor_step), None)
    if step is not None:
        parameters.append(f"tensor step every {step.every} episodes with {ranks_of(step.ranks)}")
    return ", ".join(parameters)


MARKS = {
    INVENTED: "ours: invented, and declared here",
    INFERRED: "inferred from the paper",
    OVERRULED: "printed in the paper, and overruled here by a public source behind the scenario",
}
_VERDICTS = {
    "holds": ("holds", "hold"),
    "does not hold": ("does not hold", "do not hold"),
    "not decided": ("is not decided", "are not decided"),
}
_ANSWERS = {
    "yes": ("shows a gain", "show a gain"),
    "no": ("shows a loss", "show a loss"),
    "not decided": ("decides nothing", "decide nothing"),
}


def outcome(claims: Sequence[Claim]) -> str:
    """Return what became of all claims in two sentences."""
    found = _counted([claim.verdict for claim in claims], _VERDICTS)
    compared = [claim for claim in claims if not math.isnan(claim.control.mean)]
    text = f"Of {counted(len(claims), 'claim')}, {found}." if claims else "No claim was tested."
    if not compared:
        return text
    answers = _counted([claim.tensor or "" for claim in compared], _ANSWERS)
    return (
        f"{text} Against the constant control, which lowers the learning rate as much without the tensor, "
        f"of {counted(len(compared), 'comparison')} {answers}."
    )


def _counted(found: Sequence[str], words: Mapping[str, tuple[str, str]]) -> str:
    counts = [(sum(one == name for one in found), own) for name, own in words.items()]
    return ", ".join(f"{count} {one if count == 1 else many}" for count, (one, many) in counts if count)


def reading(study: Study, claim: Claim) -> str:
    """Return what a claim's two intervals say together, in plain words; nothing of a claim that compares nothing."""
    found = [(s, c) for s in study.scenarios if s.name == claim.scenario for c in s.comparisons if c.id == claim.id]
    if not found:
        return ""
    ((scenario, comparison),) = found
    if math.isnan(claim.difference.mean):
        lost = claim.difference.n_diverged
        return f"Nothing is left to compare: in {all_pairs(lost)} a run diverged." if lost else "No pair was run."
    if claim.verdict == "holds":
        gain = _reading_of_gain(claim.control, _causes(comparison, scenario))
        return f"{gain} {with_constant_weights(claim)}" if comparison.control_base else gain
    first = "The opposite is the case: the whole interval lies below 0."
    if claim.verdict == "not decided":
        missing = math.isnan(claim.difference.low)
        first = "Too few pairs for an interval." if missing else "The interval covers 0: these runs decide nothing."
    return f"{first} {_against_control(claim.control)}."


def _causes(comparison: Comparison, scenario: Scenario) -> tuple[str, str]:
    """Return what the control shares with the candidate but not with the base, and the ending of its verb.

    With several agents the control shares among them as the candidate does, so that it accounts for that as well; the
    smaller learning rate, the base can have itself.
    """
    agents = {variant.name: variant.n_agents for variant in scenario.variants}
    candidate, base = agents.get(comparison.candidate, 1), agents.get(comparison.base, 1)
    if candidate > 1 and base == candidate:
        return "constant weights and the same sharing", ""
    return ("the smaller learning rate and the sharing", "") if candidate > 1 else ("the smaller learning rate", "s")


def _reading_of_gain(control: Difference, causes: tuple[str, str]) -> str:
    """Say whether a gain over the base is one over the control too."""
    against = _against_control(control)
    if math.isnan(control.low) or math.isnan(control.high):
        return f"{against}."
    cause, s = causes
    if control.low > 0:
        return f"{against}: {cause} alone do{'es' if s else ''} not explain it."
    if control.high < 0:
        return f"{against}: {cause} explain{s} the gain, and the tensor's weights lessen it."
    return f"{against}: {cause} explain{s} the gain, as far as these runs can tell."


def _against_control(control: Difference) -> str:
    if control.n_pairs == 0 and control.n_diverged == 0:
        return "There is no run of the control to compare it with"
    if math.isnan(control.low) or math.isnan(control.high):
        return "Too few pairs to compare it with the control"
    if control.low > 0:
        return "Better than the control"
    return "Worse than the control" if control.high < 0 else "No better than the control"


def assumed(study: Study) -> list[tuple[Assumption, str]]:
    """Return what the scenarios assume, and which of them do; what all of them assume comes first and once."""
    homes: dict[Assumption, list[str]] = {}
    for scenario in study.scenarios:
        for assumption in scenario.assumptions:
            homes.setdefault(assumption, []).append(scenario.title)
    n = len(study.scenarios)
    ordered = sorted(homes.items(), key=lambda item: len(item[1]) < n)
    return [(one, "all" if len(titles) == n > 1 else ", ".join(titles)) for one, titles in ordered]
