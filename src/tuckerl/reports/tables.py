"""The rows of two of the page's tables: what is assumed, and the claims under other readings."""

from typing import Any

from tuckerl.reports.text import amount_cell
from tuckerl.studies.sensitivity import Cell, Sensitivity
from tuckerl.studies.study import INFERRED, INVENTED, OVERRULED, Assumption, Study

MARKS = {
    INVENTED: "ours: invented, and declared here",
    INFERRED: "inferred from the paper",
    OVERRULED: "printed in the paper, and overruled here by a public source behind the scenario",
}


def assumption_rows(study: Study) -> list[dict[str, str]]:
    """Return what the scenarios assume, those of all of them first and once."""
    homes: dict[Assumption, list[str]] = {}
    for scenario in study.scenarios:
        for assumption in scenario.assumptions:
            homes.setdefault(assumption, []).append(scenario.title)
    n = len(study.scenarios)
    ordered = sorted(homes.items(), key=lambda item: len(item[1]) < n)
    return [
        {
            "mark": assumption.mark,
            "meaning": MARKS.get(assumption.mark, ""),
            "text": assumption.text,
            "where": "all" if len(titles) == n > 1 else ", ".join(titles),
        }
        for assumption, titles in ordered
    ]


def cell_rows(sensitivity: Sensitivity) -> list[dict[str, Any]]:
    """Return one row for each claim and reading, by scenario and claim."""
    cells = sensitivity.cells
    scenarios, claims = (list(dict.fromkeys(names)) for names in ([c.scenario for c in cells], [_id(c) for c in cells]))
    ordered = sorted(cells, key=lambda cell: (scenarios.index(cell.scenario), claims.index(_id(cell))))
    return [
        {
            "scenario": cell.scenario,
            "id": cell.claim.id,
            "alternative": cell.alternative,
            "verdict": cell.claim.verdict,
            "mark": cell.claim.verdict.replace(" ", "-"),
            "changed": sensitivity.is_changed(cell),
            "difference": amount_cell(cell.claim.difference),
            "control": amount_cell(cell.claim.control),
            "pairs": f"{cell.claim.difference.n_pairs:,}",
            "diverged": f"{cell.claim.difference.n_diverged:,}",
        }
        for cell in ordered
    ]


def _id(cell: Cell) -> str:
    return cell.claim.id
