"""How far the runs of a study are, on standard error: a live view on a terminal, a line now and then elsewhere."""

import heapq
import math
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from tuckerl.reports.text import counted, plus_minus
from tuckerl.studies.run_progress import RunProgress, VariantProgress

SECONDS_BETWEEN_LINES = 30.0
_A_SECOND = 4  # how often the view is drawn
_MOST_VARIANTS = 12  # that it shows
_IN_A_LINE = 4


@contextmanager
def runs_shown(what: str) -> Iterator[Callable[[RunProgress], None]]:
    """Give a function that is told how far runs are, which is shown until the block is left.

    Parameters
    ----------
    what : str
        What the runs are called.
    """
    console = Console(stderr=True)
    if not console.is_terminal:
        with _Lines(what) as lines:
            yield lines.tell
        return
    latest: RunProgress | None = None

    def tell(runs: RunProgress) -> None:
        nonlocal latest
        latest = runs

    def view() -> RenderableType:
        return Text("") if latest is None else Group(_head(what, latest), *_table(latest))

    with Live(get_renderable=view, console=console, refresh_per_second=_A_SECOND):
        yield tell


class _Lines:
    """Writes a line every so often while its block lasts, also where no run ends meanwhile."""

    def __init__(self, what: str) -> None:
        self._what = what
        self._runs: RunProgress | None = None
        self._ended = threading.Event()
        self._writer = threading.Thread(target=self._write, daemon=True)

    def __enter__(self) -> "_Lines":
        self._writer.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._ended.set()
        self._writer.join()

    def tell(self, runs: RunProgress) -> None:
        self._runs = runs

    def _write(self) -> None:
        while not self._ended.wait(SECONDS_BETWEEN_LINES):
            if self._runs is not None:
                sys.stderr.write(f"{line_of(self._what, self._runs)}\n")
                sys.stderr.flush()


def line_of(what: str, runs: RunProgress) -> str:
    """Return how far runs are, in one line, with the means of a few variants."""
    variants = runs.variants()
    shown = _best(runs, variants, _IN_A_LINE)
    means = ", ".join(f"{one.variant} {_mean(one)}" for one in shown if one.n_runs)
    best = f"best of {len(variants):,}: " if means and len(variants) > len(shown) else ""
    return "; ".join(part for part in (_counts(what, runs), best + means) if part)


def _counts(what: str, runs: RunProgress) -> str:
    """Return how many runs there are, how fast they end, the time that is left, and what went wrong."""
    parts = [f"{runs.n_done:,} of {runs.n_total:,} {what}"]
    if not math.isnan(runs.rate):
        parts += [f"{_rate(runs.rate)}", f"{_time(runs.seconds_left)} left"]
    n_diverged = sum(one.n_diverged for one in runs.variants())
    parts += [f"{n_diverged:,} diverged"] if n_diverged else []
    parts += [f"{runs.n_failed:,} failed"] if runs.n_failed else []
    return ", ".join(parts)


def _head(what: str, runs: RunProgress) -> Table:
    """Return the bar, with the counts beside it."""
    grid = Table.grid(padding=(0, 1))
    bar = ProgressBar(total=max(1, runs.n_total), completed=runs.n_done + runs.n_failed, width=30)
    grid.add_row(bar, Text(f"{_counts(what, runs)}, {_time(runs.seconds)} so far"))
    return grid


def _table(runs: RunProgress) -> list[RenderableType]:
    """Return what the variants have reached: all of a few, or the best of many; nothing before any run has ended."""
    variants = runs.variants()
    shown = _best(runs, variants, _MOST_VARIANTS)
    if not any(one.n_runs or one.n_diverged or one.n_failed for one in shown):
        return []
    several = len(runs.measures) > 1
    texts = list(dict.fromkeys(measure.text for measure in runs.measures.values()))
    title = f"{texts[0] if len(texts) == 1 else 'mean'}, ± 95 %"
    table = Table(*(["Problem"] if several else []), "Variant", "Runs", title, "Diverged", "Failed", box=None)
    for column in table.columns[-4:]:
        column.justify = "right"
    for one in shown:
        counts = (f"{number:,}" if number else "" for number in (one.n_diverged, one.n_failed))
        cells = [one.variant, f"{one.n_runs:,}", _mean(one), *counts]
        table.add_row(*map(Text, [one.scenario, *cells] if several else cells))
    left = len(variants) - len(shown)
    return [table, Text(f"the best of {counted(len(variants), 'variant')}", style="dim")] if left else [table]


def _best(runs: RunProgress, variants: list[VariantProgress], most: int) -> list[VariantProgress]:
    """Return the variants in their order where they are few, or else the best of them, best first."""
    if len(variants) <= most:
        return variants

    def worth(one: VariantProgress) -> float:
        sign = 1.0 if runs.measures[one.scenario].larger_is_better else -1.0
        return sign * one.mean if one.n_runs else -math.inf

    return heapq.nlargest(most, variants, key=worth)


def _mean(one: VariantProgress) -> str:
    return plus_minus(one.mean, one.half_width) if one.n_runs else ""


def _rate(a_second: float) -> str:
    return f"{a_second:.3g} a second" if a_second >= 1 else f"{60 * a_second:.3g} a minute"


def _time(seconds: float) -> str:
    """Return 0:07, 1:23:45 or 3 d 4 h."""
    if not math.isfinite(seconds):
        return "an unknown time"
    minutes, second = divmod(round(seconds), 60)
    hours, minute = divmod(minutes, 60)
    if hours >= 24:
        return f"{hours // 24} d {hours % 24} h"
    return f"{hours}:{minute:02}:{second:02}" if hours else f"{minute}:{second:02}"
