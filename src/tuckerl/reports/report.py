"""Writing a study's report: figures, ``claims.json`` and one page that needs nothing but itself."""

import json
from collections.abc import Sequence
from pathlib import Path

from tuckerl.errors import OutputError
from tuckerl.files import write_whole
from tuckerl.studies.claims import Claim
from tuckerl.studies.study import Study
from tuckerl.studies.summary import Summary


def write_report(study: Study, claims: Sequence[Claim], summaries: Sequence[Summary], folder: Path) -> Path:
    """Write ``figures/*.svg`` and ``*.png``, ``claims.json`` and ``report.html`` and return the page's path.

    Parameters
    ----------
    study : Study
    claims : sequence of Claim
    summaries : sequence of Summary
        One for each of the study's scenarios, as :func:`tuckerl.studies.summary.summarise` gives them.
    folder : Path
        Made if it is missing. Each file is written whole or not at all, the page last.

    Raises
    ------
    OutputError
        If the folder cannot be made or written.
    """
    # Imported here: matplotlib takes longer than all of --help.
    from tuckerl.reports.figures import PICTURES
    from tuckerl.reports.page import Shown, render_page
    from tuckerl.reports.picture import render

    figures = folder / "figures"
    try:
        figures.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"cannot make the folder {figures}: {error.strerror}; choose another folder") from error
    shown = []
    for summary in summaries:
        for picture in PICTURES:
            if picture.scenario == summary.scenario.name:
                drawn = render(picture, summary)
                write_whole(figures / f"{picture.name}.svg", drawn.svg)
                write_whole(figures / f"{picture.name}.png", drawn.png)
                shown.append(Shown(picture, summary, drawn.svg.decode()))
    lines = [claim.as_json() for claim in claims]
    write_whole(folder / "claims.json", (json.dumps(lines, indent=2, allow_nan=False) + "\n").encode())
    page = folder / "report.html"
    write_whole(page, render_page(study, claims, summaries, shown).encode())
    return page
