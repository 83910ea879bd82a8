"""Measure where the time goes, and draw and write it into docs/how-fast.md.

``python -m docs.pictures.speed`` measures anew (some minutes, on a quiet machine) and writes, beside this file,
``speed.json`` and ``speed.png``; with ``--draw`` it draws what was measured before. The page's tables are written from
the same numbers; `tests/docs/test_speed.py` fails when they are not.
"""

import json
import sys
from pathlib import Path

import matplotlib as mpl

mpl.use("agg")

import matplotlib.pyplot as plt  # the backend is chosen first
from docs.pictures.layers import table_pattern
from matplotlib.axes import Axes

HERE = Path(__file__).parent
PAGE = HERE.parent / "how-fast.md"
MEASURED = HERE / "speed.json"

STEP_PARTS = ("a random number", "the greedy action", "the outcome", "the update", "path and Ctrl-C")
WHOLE = "the whole step"


def measure() -> dict[str, dict[str, float]]:
    """Return seconds by table and row."""
    from benchmarks import first_result, parts, windows

    return {
        "step": {row.what: row.ours for row in parts.rows()},
        "window": {row.what: row.ours for row in windows.rows()},
        "first": {row.what: row.ours for row in first_result.rows()},
    }


def sizes(measured: dict[str, float]) -> list[str]:
    """Return the sizes of tables that were measured, in order."""
    return list(dict.fromkeys(what.split(":")[0] for what in measured))


def step_table(measured: dict[str, float]) -> str:
    """Return the parts of a step at each size as a table of nanoseconds."""
    lines = ["| | " + " | ".join(sizes(measured)) + " |", "|---" * (1 + len(sizes(measured))) + "|"]
    for part in (*STEP_PARTS, WHOLE):
        cells = [f"{measured[f'{size}: {part}'] * 1e9:.1f}" for size in sizes(measured)]
        lines.append(f"| {part} | " + " | ".join(cells) + " |")
    waiting = [max(0.0, measured[f"{size}: {WHOLE}"] - _sum(measured, size)) * 1e9 for size in sizes(measured)]
    return "\n".join([*lines, "| of it waiting | " + " | ".join(f"{ns:.1f}" for ns in waiting) + " |"])


def _sum(measured: dict[str, float], size: str) -> float:
    return sum(measured[f"{size}: {part}"] for part in STEP_PARTS)


def first_table(measured: dict[str, float]) -> str:
    """Return the processor time of a first result as a table of seconds."""
    lines = ["| | seconds |", "|---|---|", *(f"| {what} | {spent:.2f} |" for what, spent in measured.items())]
    return "\n".join([*lines, f"| together | {sum(measured.values()):.2f} |"])


def window_table(measured: dict[str, float]) -> str:
    """Return what windows cost as a table of microseconds."""
    rows = [f"| {what} | {spent * 1e6:,.0f} |" for what, spent in measured.items()]
    return "\n".join(["| window | microseconds |", "|---|---|", *rows])


TABLES = {"step": step_table, "window": window_table, "first": first_table}


def draw(measured: dict[str, dict[str, float]]) -> None:
    """Draw the parts of a step and of a first result as bars."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(9.2, 3.2), layout="constrained", width_ratios=(3, 2))
    step = measured["step"]
    _draw_steps(left, step)
    names = list(measured["first"])
    right.barh(names, list(measured["first"].values()), color="0.45", edgecolor="0.1")
    right.invert_yaxis()
    right.set_xlabel("seconds of processor time")
    right.set_title("A first result, nothing compiled yet", fontsize=10)
    for axes in (left, right):
        axes.spines[["top", "right"]].set_visible(False)
        axes.tick_params(labelsize=8)
    figure.savefig(HERE / "speed.png", dpi=130, metadata={"Software": None})
    plt.close(figure)


def _draw_steps(axes: Axes, step: dict[str, float]) -> None:
    """Draw a bar for each size, as long as its step, divided into its parts and waiting."""
    looks = zip(("0.95", "0.75", "0.55", "0.35", "0.15"), ("", "//", "", "..", ""), strict=True)
    begun = dict.fromkeys(sizes(step), 0.0)
    for part, (grey, hatch) in zip(STEP_PARTS, looks, strict=True):
        lengths = [100 * step[f"{size}: {part}"] / step[f"{size}: {WHOLE}"] for size in begun]
        axes.barh(list(begun), lengths, left=list(begun.values()), label=part, color=grey, hatch=hatch, edgecolor="0.1")
        begun = {size: start + length for (size, start), length in zip(begun.items(), lengths, strict=True)}
    rest = [max(0.0, 100 - start) for start in begun.values()]
    axes.barh(list(begun), rest, left=list(begun.values()), label="waiting", color="white", hatch="xx", edgecolor="0.5")
    for place, size in enumerate(begun):
        axes.text(101, place, f"{step[f'{size}: {WHOLE}'] * 1e9:.0f} ns", va="center", fontsize=8)
    axes.set_xlim(0, max(112.0, *(start + 12 for start in begun.values())))
    axes.set_xlabel("per cent of a step of Q-learning")
    axes.legend(fontsize=7, ncols=3, loc="lower center", bbox_to_anchor=(0.5, 1.0), frameon=False)


def main(*, anew: bool) -> None:
    """Measure if asked to, draw, and write the page's tables."""
    if anew:
        MEASURED.write_text(json.dumps(measure(), indent=1) + "\n", "utf-8")
    measured = json.loads(MEASURED.read_text("utf-8"))
    draw(measured)
    page = PAGE.read_text("utf-8")
    for name, table in TABLES.items():
        page = table_pattern(name).sub(f"\n{table(measured[name])}\n\n", page)
    PAGE.write_text(page, "utf-8")


if __name__ == "__main__":
    main(anew="--draw" not in sys.argv[1:])
