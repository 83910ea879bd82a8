"""Writing a study's report: figures, ``claims.json`` and one page that needs nothing but itself."""

import json
from collections.abc import Sequence
from pathlib import Path

from tuckerl.errors import OutputError
from tuckerl.files import write_whole
from tuckerl.studies.ablation import Ablation
from tuckerl.studies.claims import Claim
from tuckerl.studies.sensitivity import Cell
from tuckerl.studies.study import Study
from tuckerl.studies.summary import Summary


def write_report(
    study: Study,
    claims: Sequence[Claim],
    summaries: Sequence[Summary],
    folder: Path,
    *,
    gains: Sequence[Ablation] = (),
    sensitivity: Sequence[Cell] = (),
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
    gains : sequence of Ablation
        Where the scenarios' gains come from, as :func:`tuckerl.studies.ablation.gains` says.
    sensitivity : sequence of Cell
        The claims under other readings of the paper, of :func:`tuckerl.studies.sensitivity.sensitivity`.

    Raises
    ------
    OutputError
        If the folder cannot be made or written.
    """
    # Imported here: matplotlib takes longer than all of --help.
    from tuckerl.reports.ablation_figure import show_gain
    from tuckerl.reports.figures import PICTURES
    from tuckerl.reports.page import Extras, render_page
    from tuckerl.reports.picture import Shown, show
    from tuckerl.reports.sensitivity_figure import show_sensitivity

    figures = folder / "figures"
    try:
        figures.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"cannot make the folder {figures}: {error.strerror}; choose another folder") from error
    shown: dict[str, list[Shown]] = {summary.scenario.name: [] for summary in summaries}
    for summary in summaries:
        own = [picture for picture in PICTURES if picture.scenario == summary.scenario.name]
        shown[summary.scenario.name] += [show(picture, summary) for picture in own]
    for gain in gains:
        shown.setdefault(gain.scenario.name, []).append(show_gain(gain))
    other_readings = show_sensitivity(sensitivity) if sensitivity else None
    for one in (*(one for several in shown.values() for one in several), *([other_readings] if other_readings else [])):
        write_whole(figures / f"{one.name}.svg", one.drawn.svg)
        write_whole(figures / f"{one.name}.png", one.drawn.png)
    lines = [claim.as_json() for claim in claims]
    write_whole(folder / "claims.json", (json.dumps(lines, indent=2, allow_nan=False) + "\n").encode())
    page = folder / "report.html"
    extras = Extras(gains, sensitivity, other_readings)
    write_whole(page, render_page(study, claims, summaries, shown, extras).encode())
    return page
