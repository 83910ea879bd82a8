"""Draw the picture of the layers and count the lines for docs/code-in-an-hour.md, from the sources as they are.

``python -m docs.pictures.layers`` writes, beside this file, ``layers.png`` and ``layers.txt``, which has each folder's
imports in a line, and writes the two tables of files into the page. `tests/docs/test_layers.py` fails when they are out
of date.
"""

import ast
import io
import re
import textwrap
import tokenize
from pathlib import Path
from typing import NamedTuple

import matplotlib as mpl

mpl.use("agg")

import matplotlib.pyplot as plt  # the backend is chosen first
from matplotlib.axes import Axes
from matplotlib.patches import FancyArrowPatch, Rectangle
from tests.structure.test_structure import FOLDERS, GROUND, LAYERS, PACKAGE, imported_layers, layer_of, sources

HERE = Path(__file__).parent
PAGE = HERE.parent / "code-in-an-hour.md"

UPDATE_PATH = (
    "training/learner.py",
    "training/trainer.py",
    "training/training_state.py",
    "training/loop.py",
    "training/algorithm.py",
    "learners/q_learning.py",
)
"""The files from a call of Q-learning's `learn` to the change of its table, in the order of the calls."""

TEN_FILES = {
    "learners/q_learning.py": "the equation: the state's type, `update`, its registration, a class of one line",
    "training/algorithm.py": "what an algorithm is: `act`, `update`, `end_episode`, and the order of the first two",
    "training/loop.py": "the two loops: an agent in a world of its own, agents in one world",
    "training/agent_arrays.py": "all that kernels read and write: `AgentArrays`, `Transition`, the episodes' record",
    "training/policies/epsilon_greedy.py": "a policy: `choose`, `probabilities`, a class with its schedule",
    "training/declared_state.py": "what an algorithm keeps, and how it travels when agents share",
    "training/trainer.py": "`learn`: windows, callbacks, Ctrl-C, the tensor step after each window",
    "generalization/step.py": "the paper's idea: tables in, action weights and a mixture of tables out",
    "problems/mdp.py": "a problem: its arrays, its checks, how it is saved and described",
    "studies/processes.py": "many runs on all cores, the same bytes for any number of workers",
}
"""What to read first, in this order, and why."""


class Size(NamedTuple):
    """How long a file is."""

    code: int  # lines without blank ones, comments and docstrings
    lines: int


def size_of(path: str) -> Size:
    """Count the lines of a file of the package."""
    text = (PACKAGE / path).read_text("utf-8")
    ignored = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}
    code: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in ignored:
            code.update(range(token.start[0], token.end[0] + 1))
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            code -= set(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    return Size(len(code), text.count("\n"))


def imports() -> dict[str, set[str]]:
    """Return which other folders each folder imports, wherever in it; what all may import, the ground, is left out."""
    found: dict[str, set[str]] = {folder: set() for folder in FOLDERS}
    for source in sources():
        if layer_of(source) in FOLDERS:
            found[layer_of(source)] |= imported_layers(source) & FOLDERS
    return {folder: others - {folder} for folder, others in found.items()}


def imports_text() -> str:
    """Return the imports as text: a line for each folder, from the top layer down."""
    found, order = imports(), [folder for layer in reversed(LAYERS) for folder in layer]
    return "".join(f"{folder}: {', '.join(f for f in order if f in found[folder]) or '-'}\n" for folder in order)


def table_of(name: str) -> str:
    """Return one of the page's two tables: "path" or "ten"."""
    rows = []
    if name == "path":
        sizes = [size_of(path) for path in UPDATE_PATH]
        rows += [f"| `{path}` | {size.code} | {size.lines} |" for path, size in zip(UPDATE_PATH, sizes, strict=True)]
        rows.append(f"| together | {sum(size.code for size in sizes)} | {sum(size.lines for size in sizes)} |")
        return "\n".join(["| file | lines of code | lines in all |", "|---|---|---|", *rows])
    for number, (path, reason) in enumerate(TEN_FILES.items(), 1):
        rows.append(f"| {number} | `{path}` | {reason} | {size_of(path).code} | {size_of(path).lines} |")
    return "\n".join(["| | file | what it shows | lines of code | lines in all |", "|---|---|---|---|---|", *rows])


def table_pattern(name: str) -> re.Pattern[str]:
    """Return what finds one of the tables in the page."""
    return re.compile(rf"(?<=% begin {name}\n)(.*?)(?=% end {name}\n)", re.DOTALL)


COLUMN = {"testing": 0, "generalization": 0, "tensor": 0, "environments": 2, "problems": 2}
"""Where a folder's box stands from the left, so that arrows pass beside other boxes; the middle, 1, for all others."""
WIDTH, HEIGHT, ACROSS, DOWN = 3.45, 1.5, 4.15, 1.88
LETTERS = 40  # that fit beside each other


def description_of(folder: str) -> str:
    """Return the first sentence of a folder's docstring."""
    text = ast.get_docstring(ast.parse((PACKAGE / folder / "__init__.py").read_text("utf-8"))) or ""
    return re.split(r"[.;](?:\s|$)", text.replace("``", "").replace("\n", " "), maxsplit=1)[0]


def has_kernels(folder: str) -> bool:
    """Return whether a folder has kernels, or all that they need."""
    return any("@kernel\n" in source.read_text("utf-8") for source in (PACKAGE / folder).rglob("*.py"))


def nearest(found: dict[str, set[str]]) -> list[tuple[str, str]]:
    """Return the imports that no way through other folders leads to: the fewest arrows that say how layers stand."""

    def below(folder: str) -> set[str]:
        return found[folder].union(*(below(other) for other in found[folder]))

    return [
        (folder, other)
        for folder, others in sorted(found.items())
        for other in sorted(others)
        if not any(other in below(way) for way in others - {other})
    ]


def corner_of(folder: str) -> tuple[float, float]:
    """Return the lower left corner of a folder's box."""
    row = next(place for place, layer in enumerate(LAYERS) if folder in layer)
    return COLUMN.get(folder, 1) * ACROSS, row * DOWN


def draw_box(axes: Axes, folder: str, others: set[str], shown: set[str]) -> None:
    """Draw a folder: its name, what it is, and what it imports besides that to which arrows lead."""
    x, y = corner_of(folder)
    face = "0.85" if has_kernels(folder) else "white"
    axes.add_patch(Rectangle((x, y), WIDTH, HEIGHT, facecolor=face, edgecolor="0.15", lw=1.2, zorder=3))
    axes.text(x + 0.1, y + HEIGHT - 0.08, folder, fontsize=10, fontweight="bold", va="top", zorder=4)
    text = textwrap.fill(description_of(folder), LETTERS)
    axes.text(x + 0.1, y + HEIGHT - 0.36, text, fontsize=6.5, va="top", linespacing=1.2, zorder=4)
    more = sorted(others - shown)
    if more:
        also = textwrap.fill(f"imports {', '.join(more)}, too", LETTERS)
        axes.text(x + 0.1, y + 0.06, also, fontsize=6.5, va="bottom", style="italic", linespacing=1.2, zorder=4)


def draw_arrow(axes: Axes, folder: str, other: str) -> None:
    """Draw an arrow from a box down to one that it imports."""
    (x, y), (x_to, y_to) = corner_of(folder), corner_of(other)
    side = (x_to > x) - (x_to < x)
    start, end = (x + WIDTH * (1 + 0.96 * side) / 2, y), (x_to + WIDTH * (1 - 0.96 * side) / 2, y_to + HEIGHT)
    axes.add_patch(FancyArrowPatch(start, end, arrowstyle="-|>", mutation_scale=13, color="0.15", lw=1.3, zorder=2))


def draw() -> None:
    """Draw the layers from the imports as they are."""
    found = imports()
    arrows = nearest(found)
    figure, axes = plt.subplots(figsize=(9.6, 13.6))
    right = 2 * ACROSS + WIDTH
    for place in range(0, len(LAYERS), 2):  # every other layer stands on a grey band
        y = place * DOWN - (DOWN - HEIGHT) / 2
        axes.add_patch(Rectangle((-0.2, y), right + 0.4, DOWN, facecolor="0.95", edgecolor="none", zorder=0))
    for folder in FOLDERS:
        draw_box(axes, folder, found[folder], {other for source, other in arrows if source == folder})
    for folder, other in arrows:
        draw_arrow(axes, folder, other)
    axes.add_patch(Rectangle((0, -DOWN + 0.4), right, 0.72, facecolor="0.85", edgecolor="0.15", lw=1.2, zorder=3))
    axes.text(0.1, -DOWN + 1.02, "ground", fontsize=10, fontweight="bold", va="top", zorder=4)
    ground = ", ".join(sorted(GROUND))
    axes.text(0.1, -DOWN + 0.5, f"single modules that every layer may import: {ground}", fontsize=6.5, zorder=4)
    notes = "An arrow: imports.\nGrey box: has kernels.\nBand: one layer."
    axes.text(0, len(LAYERS) * DOWN - 0.5, notes, fontsize=8, va="top", linespacing=1.4)
    axes.set_xlim(-0.25, right + 0.25)
    axes.set_ylim(-DOWN + 0.3, len(LAYERS) * DOWN - 0.2)
    axes.axis("off")
    figure.savefig(HERE / "layers.png", dpi=130, bbox_inches="tight", metadata={"Software": None})
    plt.close(figure)


def main() -> None:
    """Write the picture, its imports, and the page's tables."""
    draw()
    (HERE / "layers.txt").write_text(imports_text(), "utf-8")
    page = PAGE.read_text("utf-8")
    for name in ("path", "ten"):
        page = table_pattern(name).sub(f"\n{table_of(name)}\n\n", page)
    PAGE.write_text(page, "utf-8")


if __name__ == "__main__":
    main()
