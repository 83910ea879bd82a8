"""A study's report: figures, ``claims.json`` and one page that needs nothing but itself."""

from collections.abc import Mapping, Sequence
from itertools import chain, product
from pathlib import Path

from markupsafe import Markup

from tuckerl.reports.ablation import what_works, without_the_step
from tuckerl.reports.figure import draw_figures
from tuckerl.reports.figures import FIGURES
from tuckerl.reports.markup import rendered, versions, write_page
from tuckerl.reports.report_text import MARKS, assumed, described, outcome, reading
from tuckerl.studies.ablation import Ablation
from tuckerl.studies.claims import Claim
from tuckerl.studies.scenarios import SCENARIOS, scenario_study
from tuckerl.studies.sensitivity import Sensitivity
from tuckerl.studies.study import Scenario, Study
from tuckerl.studies.summary import Summary

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
    figures = {summary.scenario.name: draw_figures(FIGURES, summary) for summary in summaries}
    of_ablations = [(ablation, draw_figures(FIGURES, ablation)) for ablation in ablations]
    of_cells = draw_figures(FIGURES, sensitivity)
    drawn = [*figures.values(), *(own for _, own in of_ablations), of_cells]
    page = rendered(
        "report.html",
        claims=[(claim, reading(study, claim)) for claim in claims],
        outcome=outcome(claims),
        marks=MARKS,
        assumptions=assumed(study),
        summaries=summaries,
        figures=figures,
        ablations=of_ablations,
        sensitivity=sensitivity,
        sensitivity_figures=of_cells,
        seed=study.seed,
        commands=commands(study, with_cells=bool(sensitivity.cells)),
        versions=versions(*_LIBRARIES),
        plotly_js=_plotly_js() if any(figure.plotly for own in drawn for figure in own) else "",
        described=described,
        settings=_settings,
        what_works=what_works,
        without_the_step=without_the_step,
    )
    numbers = [claim.to_dict() for claim in claims]
    return write_page(folder, "report.html", page, chain.from_iterable(drawn), ("claims.json", numbers))


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
        parameters.append(f"tensor step every {step.every} episodes with ranks {step.ranks}")
    return ", ".join(parameters)


def _plotly_js() -> Markup:
    # Imported here: only a page with interactive figures pays for it.
    from plotly.offline import get_plotlyjs

    return Markup(get_plotlyjs())  # noqa: S704  # a script of the installed package; it holds no </script
