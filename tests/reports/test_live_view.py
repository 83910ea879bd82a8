"""How far runs are, as a terminal shows it and as a log keeps it."""

import io
import math
import re
import time
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr

import pytest
from rich.console import Console

from tests.studies.comparisons import small_comparison
from tuckerl.reports import live_view
from tuckerl.reports.live_view import line_of, runs_shown
from tuckerl.studies.run_progress import RunProgress, VariantProgress


class Known(RunProgress):
    """Progress whose numbers are given."""

    def __init__(self, variants: list[VariantProgress], n_done: int, n_total: int) -> None:
        super().__init__(small_comparison(n_runs=1).study, 0, n_total)
        self.n_done, self.n_failed, self._known = n_done, 1, variants
        self.measures = {variants[0].scenario: next(iter(self.measures.values()))}

    rate, seconds_left = 2.5, 3725.0

    def variants(self) -> list[VariantProgress]:
        return self._known


TWO = [
    VariantProgress("lake", "q-learning[alpha=0.1]", 40, 0.5, 0.031, 2, 0),
    VariantProgress("lake", "[red]sarsa[/red]", 1, 0.25, math.nan, 0, 1),
]


def test_a_line_tells_counts_rate_time_and_means() -> None:
    assert line_of("runs", Known(TWO, 43, 1000)) == (
        "43 of 1,000 runs, 2.5 a second, 1:02:05 left, 2 diverged, 1 failed; "
        "q-learning[alpha=0.1] 0.5000 ± 0.031, [red]sarsa[/red] 0.2500"
    )


def test_of_many_variants_the_best_are_shown() -> None:
    many = [VariantProgress("lake", f"v{k}", 1, float(k), math.nan, 0, 0) for k in range(100)]
    line = line_of("runs", Known(many, 43, 1000))
    assert line.endswith("best of 100: v99 99.00, v98 98.00, v97 97.00, v96 96.00")


@contextmanager
def _terminal(monkeypatch: pytest.MonkeyPatch) -> Iterator[io.StringIO]:
    written = io.StringIO()
    console = Console(file=written, force_terminal=True, width=110, height=40)
    monkeypatch.setattr(live_view, "Console", lambda **_: console)
    yield written


def test_a_terminal_shows_a_table_and_is_left_clean(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted() -> None:
        with runs_shown("runs") as show:
            show(Known(TWO, 43, 1000))
            raise KeyboardInterrupt

    with _terminal(monkeypatch) as written, pytest.raises(KeyboardInterrupt):
        interrupted()
    text = written.getvalue()
    assert text.count("\x1b[?25l") == text.count("\x1b[?25h") == 1, "the cursor is shown again"
    assert text.endswith("\n\x1b[?25h"), "and what comes next begins a line"
    last = re.sub("\x1b\\[[0-9;?]*[a-zA-Z]", "", text).splitlines()
    rows = [row.split() for row in last]
    assert ["q-learning[alpha=0.1]", "40", "0.5000", "±", "0.031", "2"] in rows
    assert ["[red]sarsa[/red]", "1", "0.2500", "1"] in rows
    assert any("43 of 1,000 runs, 2.5 a second, 1:02:05 left, 2 diverged, 1 failed" in row for row in last)


def test_elsewhere_a_line_is_written_every_so_often(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live_view, "SECONDS_BETWEEN_LINES", 0.05)
    said = io.StringIO()
    with redirect_stderr(said), runs_shown("runs") as show:
        time.sleep(0.12)  # nothing is known yet
        show(Known(TWO, 43, 1000))
        time.sleep(0.3)
    lines = said.getvalue().splitlines()
    assert 2 <= len(lines) <= 7
    assert set(lines) == {line_of("runs", Known(TWO, 43, 1000))}
