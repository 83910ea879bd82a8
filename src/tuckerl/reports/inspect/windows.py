"""What the tensor step did after each window: whose table was copied, how well the tables were fitted, which ranks."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from tuckerl.generalization.step import TensorStepHistory
from tuckerl.reports import styles
from tuckerl.reports.figure import WIDTH, FigureSpec, panel, panel_figure
from tuckerl.reports.inspect.content import Inspection
from tuckerl.reports.inspect.weights import draw_course, drawn_windows, every_words
from tuckerl.reports.styles import EndLabel, LineStyle, count_episodes, label_ends, write
from tuckerl.reports.text import counted, joined, number, percent, span
from tuckerl.studies.figure_text import FigureText
from tuckerl.types import FloatArray, IntArray

_MODES = {
    "states": LineStyle(styles.BLUE, "solid", "o", 2.2),
    "actions": LineStyle(styles.VERMILLION, "solid", "s", 1.4),
    "episodes": LineStyle(styles.GREEN, "dashed", "^", 1.4),
    "agents": LineStyle(styles.PURPLE, "dashdot", "D", 1.4),
}
_FIT = LineStyle(styles.BLACK, "solid", "o", 1.5)
_NOBODY = -1
MOST_AGENTS = 30
"""So many agents have a row each, copied or not."""
_SEEN_EDGES = 120  # windows between which white lines still leave colour
_LISTED = 8


def copied_counts(inspection: Inspection) -> IntArray:
    """Return after how many windows each agent's table was copied, and last, after how many none was: (N + 1,)."""
    chosen = np.where(inspection.history.chosen == _NOBODY, inspection.n_agents, inspection.history.chosen)
    return np.bincount(chosen, minlength=inspection.n_agents + 1)


def rows_of_agents(inspection: Inspection) -> list[int]:
    """Return the agents that have a row: all, or of very many those copied most often, in order of number."""
    counts = copied_counts(inspection)[:-1]
    if inspection.n_agents <= MOST_AGENTS:
        return list(range(inspection.n_agents))
    most = np.argsort(-counts, kind="stable")[:MOST_AGENTS]
    return sorted(int(agent) for agent in most if counts[agent])


def draw_copied(inspection: Inspection) -> Figure:
    """Draw a row for each agent, filled at the windows after which its table was copied by all."""
    history, counts = inspection.history, copied_counts(inspection)
    agents = rows_of_agents(inspection)
    rows = [*agents, inspection.n_agents]
    high = max(0.6, (0.24 if len(rows) <= 12 else 0.17) * len(rows))
    figure, axes = panel_figure(1.15, 0.46, WIDTH - 1.15 - 1.1, high, 0.29)
    starts = np.append(0, history.episode[:-1])
    edge = 0.5 if history.episode.size <= _SEEN_EDGES else 0.0
    for place, row in enumerate(rows):
        nobody = row == inspection.n_agents
        mine = history.chosen == (_NOBODY if nobody else row)
        spans = list(zip(starts[mine].tolist(), (history.episode - starts)[mine].tolist(), strict=True))
        look: dict[str, Any] = {"facecolor": "0.8", "hatch": "////"} if nobody else {"facecolor": styles.BLUE}
        axes.broken_barh(spans, (place - 0.38, 0.76), edgecolor="white", linewidth=edge, **look)
    axes.set_yticks(range(len(rows)), [*(f"agent {agent}" for agent in agents), "none or mixture"])
    for place, row in enumerate(rows):
        part = percent(counts[row] / counts.sum())
        words = f"{counts[row]:,} ({part})" if counts[row] else "0"
        write(axes, 1.015, place, words, axes.get_yaxis_transform())
    axes.set_ylim(len(rows) - 0.5, -0.5)
    count_episodes(axes, int(history.episode[-1]))
    axes.tick_params(axis="y", length=0)
    axes.set_title("table that all agents went on with", loc="left")
    write(axes, 1.015, 1.0, " windows", axes.transAxes, verticalalignment="bottom")
    return figure


def _copied_caption(inspection: Inspection) -> str:
    counts = copied_counts(inspection)
    windows = counted(int(counts.sum()), "window")
    most = np.argsort(-counts[:-1], kind="stable")[:_LISTED]
    listed = [f"agent {agent}'s after {counts[agent]:,}" for agent in most if counts[agent]]
    rest = int(counts[:-1].sum() - counts[most].sum())
    if rest:
        listed.append(f"the others' after {rest:,}")
    words = f"Of {windows}, all agents went on with " + (joined(listed) if listed else "one agent's table after none")
    if counts[-1]:
        words += f"; after {counts[-1]:,} no single table was copied (nothing was shared, or a mixture of the tables)"
    hidden = inspection.n_agents - len(rows_of_agents(inspection))
    if hidden:
        words += f". {hidden:,} agents, copied seldom or never, are not drawn"
    return f"{words}. A bar spans the window of episodes that the choice was made from."


def _copied_alt(inspection: Inspection) -> str:
    counts = copied_counts(inspection)
    listed = [f"agent {agent} {counts[agent]:,}" for agent in range(min(inspection.n_agents, _LISTED))]
    return (
        f"A strip for each agent. Windows after which its table was copied: {', '.join(listed)}; none {counts[-1]:,}."
    )


COPIED = FigureSpec(
    Inspection,
    FigureText("copied", "Who was copied when"),
    draw_copied,
    _copied_caption,
    _copied_alt,
    applies=lambda one: one.n_agents > 1 and one.n_windows > 0,
)


def draw_fit(inspection: Inspection) -> Figure:
    """Draw the fit of each window's decomposition and the ranks that it used."""
    history = drawn_windows(inspection.history)
    figure = Figure(figsize=(WIDTH, 2.7))
    left, right = (panel(figure, place, 0.46, 2.55, 1.94) for place in (0.7, 3.85))
    draw_course(left, history.episode, history.fit, _FIT)
    left.set_title("fit", loc="left")
    left.set_ylabel("1 \N{MINUS SIGN} relative error")
    left.margins(y=0.15)
    left.ticklabel_format(axis="y", useOffset=False)
    ranks = _used(history)
    for place, (look, values) in enumerate(zip(_MODES.values(), ranks.T, strict=True)):
        draw_course(right, history.episode, values, look, place / 4)
    right.set_title("ranks used", loc="left")
    right.set_ylabel("columns of the factor")
    right.set_ylim(0, 1.08 * float(np.nanmax(ranks)))
    right.yaxis.set_major_locator(MaxNLocator(6, integer=True))
    for axes in (left, right):
        count_episodes(axes, int(history.episode[-1]), 5)
    last = ranks[np.flatnonzero(np.isfinite(ranks[:, 0]))[-1]]
    ends = zip(_MODES.items(), last, strict=True)
    label_ends(right, [EndLabel(name, float(value), look.colour) for (name, look), value in ends])
    return figure


def _used(history: TensorStepHistory) -> FloatArray:
    """Return the ranks after each window, NaN where there was no decomposition."""
    ranks = history.ranks.astype(np.float64)
    ranks[ranks == 0] = np.nan
    return ranks


def _fit_caption(inspection: Inspection) -> str:
    fit = inspection.history.fit[np.isfinite(inspection.history.fit)]
    without = inspection.history.fit.size - fit.size
    words = "Left: the fit of each window's Tucker decomposition, 1 minus the relative error (1 is exact)"
    if fit.size:
        words += f"; it is {span(fit)}, after the last one {number(float(fit[-1]))}"
    ranks = _used(inspection.history)
    listed = [f"{name} {span(column[np.isfinite(column)])}" for name, column in zip(_MODES, ranks.T, strict=True)]
    words += f". Right: the columns of each factor, clipped to what the tables allow: {joined(listed)}"
    if without:
        words += f". {counted(without, 'window')} had no decomposition (nothing was learned yet)"
    return f"{words}{every_words(inspection.history)}."


def _fit_alt(inspection: Inspection) -> str:
    fit = inspection.history.fit[np.isfinite(inspection.history.fit)]
    return (
        f"Curves of the fit and of the four ranks by window. The fit is {span(fit)} over {counted(fit.size, 'window')}."
    )


FIT = FigureSpec(
    Inspection,
    FigureText("fit", "Fit and ranks by window"),
    draw_fit,
    _fit_caption,
    _fit_alt,
    applies=lambda one: bool(np.isfinite(one.history.fit).any() and one.history.ranks.any()),
)
