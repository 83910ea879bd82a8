"""Warnings as commands show them: one line on standard error, without the place in the code."""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import typer

from tuckerl.errors import (
    DamagedResultsWarning,
    DecompositionWarning,
    DivergenceWarning,
    FailedRunsWarning,
    KernelCacheWarning,
    RankWarning,
    ResumeWarning,
    StepCapWarning,
    WorkerWarning,
    ZeroWeightWarning,
)

OWN: tuple[type[Warning], ...] = (
    RankWarning,
    ZeroWeightWarning,
    DecompositionWarning,
    StepCapWarning,
    ResumeWarning,
    DivergenceWarning,
    KernelCacheWarning,
    DamagedResultsWarning,
    FailedRunsWarning,
    WorkerWarning,
)


@contextmanager
def short_warnings(*quiet: type[Warning]) -> Iterator[None]:
    """Show this library's warnings as one sentence each, once, but for the `quiet` ones; others as ever."""
    with warnings.catch_warnings():
        shown_before, shown = warnings.showwarning, set()

        def show(message: Warning | str, category: type[Warning], *where: Any, **more: Any) -> None:
            if not issubclass(category, OWN):
                shown_before(message, category, *where, **more)
            elif str(message) not in shown:
                shown.add(str(message))
                typer.echo(f"tuckerl: warning: {message}", err=True)

        warnings.showwarning = show
        for category in OWN:
            warnings.simplefilter("ignore" if category in quiet else "always", category)
        yield
