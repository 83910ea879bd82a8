"""The paths that the variants found in one maze: the form of Figure 10."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from tuckerl.checks import shown
from tuckerl.errors import ProblemError
from tuckerl.problems.maze import Cell, Maze
from tuckerl.reports.figure import WIDTH, Columns, FigureSpec, Live
from tuckerl.reports.lines import looks_of
from tuckerl.reports.styles import BLACK, GREEN, LineStyle, line_styles
from tuckerl.reports.text import counted, joined
from tuckerl.studies.figure_text import PathText
from tuckerl.studies.summary import Path, Summary

_WALL = "0.7"
_SHORTEST = LineStyle(GREEN, "solid", "", 1.6)
_BESIDE, _ABOVE_AND_BELOW = 0.6, 1.2  # inches of what is no maze


def draw_paths(summary: Summary) -> Figure:
    """Draw each variant's shortest episode beside the shortest possible path."""
    maze = first_maze(summary)
    styles = line_styles(summary.scenario)
    n_panels = len(summary.paths) + 1
    height = (WIDTH - _BESIDE) / n_panels * maze.rows / maze.columns + _ABOVE_AND_BELOW
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    panels = figure.subplots(1, n_panels, sharey=True, squeeze=False)[0]
    for axes, path in zip(panels, summary.paths, strict=False):
        cells = [maze.cell(state) for state in path.states]
        _draw_panel(axes, maze, cells, styles[path.variant])
        _title(axes, path.variant, path_words(summary, maze, path))
    shortest = maze.shortest_path()
    _draw_panel(panels[-1], maze, shortest, _SHORTEST)
    _title(panels[-1], "shortest possible", f"{len(shortest) - 1} steps")
    panels[0].set_ylabel("row", labelpad=1)
    figure.legend(*panels[-1].get_legend_handles_labels(), loc="outside lower center", ncols=2, frameon=False)
    return figure


def first_maze(summary: Summary) -> Maze:
    """Return the maze of instance 0.

    Raises
    ------
    ProblemError
        If the scenario's problem is not a maze.
    """
    scenario = summary.scenario
    maze = scenario.problem(0)
    if not isinstance(maze, Maze):
        raise ProblemError(f"only paths in a Maze can be drawn; {scenario.name}'s problem is {shown(maze)}")
    return maze


def _text(summary: Summary) -> PathText:
    scenario = summary.scenario
    return scenario.text_of(PathText(f"paths-{scenario.name}", f"{scenario.title}: paths found in one maze"))


def path_words(summary: Summary, maze: Maze, path: Path) -> str:
    """Return a path's length in words, and the paper's where it gives one."""
    if path.states.size == 0:
        return "no finished episode"
    words = counted(path.states.size - 1, "step")
    if maze.cell(path.states[-1]) != maze.goal:
        words += ", goal not reached"
    paper = _text(summary).paper_steps.get(path.variant)
    return words if paper is None else f"{words} (paper: {paper})"


def _draw_panel(axes: Axes, maze: Maze, cells: list[Cell], look: LineStyle) -> None:
    square = np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)])
    squares = np.argwhere(maze.walls)[:, np.newaxis, ::-1] + square
    axes.add_collection(PolyCollection(squares, facecolors=_WALL, edgecolors="none"), autolim=False)
    axes.plot([c for _, c in cells], [r for r, _ in cells], color=look.colour, linewidth=1.5, solid_joinstyle="round")
    ring = {"linestyle": "none", "markerfacecolor": "white", "markeredgewidth": 1.2, "zorder": 4}
    axes.plot(*maze.start[::-1], marker="s", markersize=5, markeredgecolor=BLACK, label="start", **ring)  # type: ignore[arg-type]  # keywords of several types
    axes.plot(*maze.goal[::-1], marker="D", markersize=5, markeredgecolor=BLACK, label="goal", **ring)  # type: ignore[arg-type]  # keywords of several types
    axes.set_xlim(-0.5, maze.columns - 0.5)
    axes.set_ylim(maze.rows - 0.5, -0.5)  # row 0 is at the top
    axes.set_aspect("equal")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(4, integer=True))
    axes.set_xlabel("column", labelpad=1)
    axes.spines[:].set_visible(True)


def _title(axes: Axes, name: str, words: str) -> None:
    axes.set_title(name, fontweight="bold", loc="left", pad=15, parse_math=False)
    axes.text(0, 1.03, words, fontsize=8, transform=axes.transAxes)


def _caption(summary: Summary) -> str:
    scenario = summary.scenario
    shortest = len(first_maze(summary).shortest_path()) - 1
    return (
        f"The shortest of {counted(scenario.n_episodes, 'episode')} that each variant walked in maze 0, run 0, while "
        "learning went on (of several agents, the one with the shortest); right, the shortest possible path, "
        f"{shortest} steps. {_caption_of_all(summary)}"
    )


def _caption_of_all(summary: Summary) -> str:
    words = ["A step into a wall or over the border counts and does not move."]
    if _text(summary).paper_steps:
        words.append(
            "The paper's numbers belong to a maze that it does not publish: only their order can be compared, and one "
            "maze decides nothing."
        )
    judged = [comparison.id for comparison in summary.scenario.comparisons if comparison.measure == "path"]
    if judged:
        claims_are = "Claims {} are" if len(judged) > 1 else "Claim {} is"
        words.append(f"{claims_are.format(joined(judged))} judged on all.")
    return " ".join(words)


def _alt(summary: Summary) -> str:
    maze = first_maze(summary)
    paths = "; ".join(f"{path.variant}: {path_words(summary, maze, path)}" for path in summary.paths)
    return (
        f"One maze drawn {len(summary.paths) + 1} times with a path from start to goal. {paths}. Shortest possible: "
        f"{len(maze.shortest_path()) - 1} steps."
    )


def _columns(summary: Summary) -> Columns:
    """Return the cells of the paths that are drawn, a row for each step."""
    maze = first_maze(summary)
    rows = [(path.variant, step, *maze.cell(state)) for path in summary.paths for step, state in enumerate(path.states)]
    names = ("variant", "step", "row", "column")
    return dict(zip(names, zip(*rows, strict=True) if rows else [()] * len(names), strict=True))


def _live(summary: Summary) -> Live:
    """Return the maze and the paths of all episodes, where there are any; of older results, the shortest ones."""
    maze, text = first_maze(summary), _text(summary)
    content = {
        "title": text.title,
        "rows": maze.rows,
        "columns": maze.columns,
        "walls": np.flatnonzero(maze.walls).tolist(),
        "start": maze.start,
        "goal": maze.goal,
        "shortest": len(maze.shortest_path()) - 1,
        "looks": looks_of(line_styles(summary.scenario)),
        "paths": [
            {
                "name": path.variant,
                "best": path.states.tolist(),
                "words": path_words(summary, maze, path),
                "episodes": [states.tolist() for states in path.episodes],
            }
            for path in summary.paths
        ],
    }
    caption = (
        "The way of each variant through maze 0 in run 0, while learning went on (of several agents, the one with the "
        f"shortest episode). {_caption_of_all(summary)}"
    )
    return Live("paths", content, caption)


PATHS = FigureSpec(
    Summary,
    _text,
    draw_paths,
    _caption,
    _alt,
    applies=lambda one: bool(one.paths) and isinstance(one.scenario.problem(0), Maze),
    columns=_columns,
    live=_live,
)
