"""Writing a comparison's report: its figure, ``compare.json`` and one page that needs nothing but itself."""

import json
from pathlib import Path

from tuckerl.errors import OutputError
from tuckerl.files import write_whole
from tuckerl.studies.compared import ComparisonResult


def write_comparison(compared: ComparisonResult, folder: Path) -> Path:
    """Write ``figures/compare.svg`` and ``.png``, ``compare.json`` and ``report.html``; return the page's path.

    Parameters
    ----------
    compared : ComparisonResult
    folder : Path
        Made if it is missing. Each file is written whole or not at all, the page last.

    Raises
    ------
    OutputError
        If the folder cannot be made or written.
    """
    # Imported here: matplotlib takes longer than all of --help.
    from tuckerl.reports.compare_figure import show_compared
    from tuckerl.reports.compare_page import comparison_page

    figures = folder / "figures"
    try:
        figures.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"cannot make the folder {figures}: {error.strerror}; choose another folder") from error
    shown = show_compared(compared)
    write_whole(figures / f"{shown.name}.svg", shown.drawn.svg)
    write_whole(figures / f"{shown.name}.png", shown.drawn.png)
    numbers = json.dumps(compared.as_json(), indent=2, allow_nan=False, ensure_ascii=False) + "\n"
    write_whole(folder / "compare.json", numbers.encode())
    page = folder / "report.html"
    write_whole(page, comparison_page(compared, shown).encode())
    return page
