"""Why the first run with an algorithm and a kind of problem takes a while to begin."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager

import typer

from tuckerl._jit import compiling_noticed


@contextmanager
def compiling_said() -> Iterator[None]:
    """Say on a terminal, in one line, that kernels are being compiled, if they are."""
    if not sys.stderr.isatty():
        yield
        return
    with compiling_noticed(lambda: typer.echo("Compiling kernels: some seconds, the first time only", err=True)):
        yield
