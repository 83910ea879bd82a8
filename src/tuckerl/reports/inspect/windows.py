"""What the tensor step did after each window: its weights, whose table was copied, how tables were decomposed."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from tuckerl.generalization.step_history import TensorStepHistory
from tuckerl.reports import styles
from tuckerl.reports.action_weights import MEANING, Course, constant_words, draw_course, draw_courses, ends_words
from tuckerl.reports.figure import WIDTH, FigureSpec, Live
from tuckerl.reports.inspect.content import Inspection
from tuckerl.reports.inspect.explore import packed
from tuckerl.reports.styles import ACTION_STYLES, EndLabel, LineStyle, count_episodes, label_ends, write
from tuckerl.reports.text import counted, joined, number, percent, span
from tuckerl.studies.figure_text import FigureText
from tuckerl.types import FloatArray, IntArray

MOST_DRAWN = 1000
"""So many windows are drawn; of more, every second, third, ..."""


def drawn_windows(history: TensorStepHistory) -> TensorStepHistory:
    """Return the last window and every so many before it: not more than are drawn."""
    every = windows_apart(history)
    return TensorStepHistory._make(column[(history.episode.size - 1) % every :: every] for column in history)


def windows_apart(history: TensorStepHistory) -> int:
    """Return that every so many windows are drawn."""
    return max(1, -(-history.episode.size // MOST_DRAWN))


def every_words(history: TensorStepHistory) -> str:
    """Return which windows are drawn where not all are."""
    every = windows_apart(history)
    return f". Only the last window and one in {every} before it are drawn" if every > 1 else ""


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
    figure = Figure(figsize=(WIDTH, high + 0.75), layout="constrained")
    axes = figure.subplots()
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


def live_windows(inspection: Inspection) -> Live:
    """Return what the tensor step did after each of the windows that are drawn."""
    history = drawn_windows(inspection.history)
    content = {
        "episode": history.episode.tolist(),
        "weights": packed(history.weights),
        "chosen": history.chosen.tolist(),
        "fit": packed(history.fit),
        "ranks": packed(history.ranks, "<i4"),
        "modes": list(_MODES),
        "actions": inspection.action_names,
        "agents": inspection.n_agents,
        "figures": ["weights", "copied", "fit"],
    }
    return Live("windows", content)


def _course(inspection: Inspection) -> Course:
    history = drawn_windows(inspection.history)
    return Course("", history.episode, history.weights)


def _weights_caption(inspection: Inspection) -> str:
    history, n_actions, names = inspection.history, inspection.n_actions, inspection.action_names
    last = history.weights[-1]
    low, high = int(last.argmin()), int(last.argmax())
    look = "Dotted" if n_actions <= len(ACTION_STYLES) else "Lighter is more; not drawn"
    ends = (
        f"all are {number(float(last[low]))}"
        if last[low] == last[high]
        else f"the least is {number(float(last[low]))} ({names[low]}), the largest {number(float(last[high]))} "
        f"({names[high]})"
    )
    return (
        f"{MEANING}, as the tensor step set it after each of {counted(history.episode.size, 'window')}, until the "
        f"next one ends; during the first window it is 1. {look}, the constant control, {constant_words(n_actions)}"
        f"{every_words(history)}. After the last window {ends}."
    )


def _weights_alt(inspection: Inspection) -> str:
    kind = "Curves" if inspection.n_actions <= len(ACTION_STYLES) else "A map"
    ends = ends_words(_course(inspection), inspection.action_names)
    return f"{kind} of each action's weight by window. After the last one, largest first: {ends}."


WEIGHTS = FigureSpec(
    Inspection,
    FigureText("weights", "Action weights by window"),
    lambda one: draw_courses([_course(one)], one.action_names),
    _weights_caption,
    _weights_alt,
    applies=lambda one: one.n_windows > 0,
    live=live_windows,
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
    only_shared = (inspection.history.ranks == 0).all(axis=1)
    decomposed = TensorStepHistory._make(column[~only_shared] for column in inspection.history)
    history = drawn_windows(decomposed)
    figure = Figure(figsize=(WIDTH, 2.7), layout="constrained")
    left, right = figure.subplots(1, 2)
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
    ranks[ranks <= 0] = np.nan
    return ranks


def _fit_caption(inspection: Inspection) -> str:
    fit = inspection.history.fit[np.isfinite(inspection.history.fit)]
    failed = int(inspection.history.failed.sum())
    without = inspection.history.fit.size - fit.size - failed
    words = "Left: the fit of each window's Tucker decomposition, 1 minus the relative error (1 is exact)"
    if fit.size:
        words += f"; it is {span(fit)}, after the last one {number(float(fit[-1]))}"
    ranks = _used(inspection.history)
    listed = [f"{name} {span(column[np.isfinite(column)])}" for name, column in zip(_MODES, ranks.T, strict=True)]
    words += f". Right: the columns of each factor, clipped to what the tables allow: {joined(listed)}"
    if without:
        words += (
            f". {counted(without, 'window')} had no decomposition (nothing was learned yet, or tables were only shared)"
        )
    if failed:
        words += f". No decomposition could be found after {counted(failed, 'window')}: weights and tables stayed"
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
    applies=lambda one: bool(np.isfinite(one.history.fit).any() and (one.history.ranks > 0).any()),
)
