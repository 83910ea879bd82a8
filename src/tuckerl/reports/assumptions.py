"""The assumptions of a study, as rows of a table."""

from tuckerl.studies.assumptions import INFERRED, INVENTED, OVERRULED, Assumption
from tuckerl.studies.study import Study

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
