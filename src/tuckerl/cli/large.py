"""Very many runs are asked about before they begin."""

import sys

import typer

from tuckerl.errors import ParameterError


def ask_if_large(n_runs: int, of_what: str, yes: bool) -> None:
    """Ask whether so many runs are meant where they are very many; nobody is asked who does not sit at a terminal.

    Parameters
    ----------
    n_runs : int
    of_what : str
    yes : bool
        Whether that was said already.

    Raises
    ------
    ParameterError
        If nobody can be asked.
    Exit
        If they are not meant.
    """
    from tuckerl.reports.study import MOST_RUNS

    if yes or n_runs <= MOST_RUNS:
        return
    words = f"{of_what}: these are {n_runs:,} runs"
    if not sys.stdin.isatty():
        raise ParameterError(f"{words}; if that is meant, give --yes")
    if not typer.confirm(f"{words}. Play them all?", err=True):
        raise typer.Exit(1)
