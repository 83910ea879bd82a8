"""The command ``tuckerl``: parse, call, print. Nothing is computed here.

Exit status: 0 done; 2 wrong input, said in one sentence on standard error; 130 interrupted; 1 anything else.
"""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import typer
from typer.exceptions import Exit, TyperException

from tuckerl import errors
from tuckerl._version import __version__
from tuckerl.cli.compare import compare
from tuckerl.cli.evaluate import evaluate
from tuckerl.cli.listing import list_names
from tuckerl.cli.mistakes import answer
from tuckerl.cli.reproduce import reproduce
from tuckerl.cli.show import show
from tuckerl.cli.signals import endings_are_interrupts
from tuckerl.cli.study import study
from tuckerl.cli.train import train
from tuckerl.cli.tune import tune
from tuckerl.cli.watch import watch
from tuckerl.files import FULL

_NAME = "tuckerl"  # also where it was started by `python -m tuckerl`
INTERRUPTED = 130
_INTERRUPTED = "interrupted: what is finished is kept, the same command goes on from there"

COMMANDS: dict[str, Callable[..., None] | typer.Typer] = {
    "reproduce": reproduce,
    "train": train,
    "evaluate": evaluate,
    "show": show,
    "compare": compare,
    "study": study,
    "tune": tune,
    "watch": watch,
    "list": list_names,
}
"""All commands, or groups of them; the first line of each one's docstring describes it. To add one, write its file and
list it here."""

app = typer.Typer(
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="Tabular reinforcement learning, with knowledge shared through Tucker decompositions of Q-tables.",
)
for _name, _command in COMMANDS.items():
    if isinstance(_command, typer.Typer):
        app.add_typer(_command, name=_name)
    else:
        app.command(_name)(_command)


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"tuckerl {__version__}")
        raise Exit


@app.callback()
def _options(
    version: bool = typer.Option(
        False, "--version", callback=_print_version, is_eager=True, help="Print the version and exit."
    ),
) -> None:
    """Hold the options that come before any command."""


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and exit with its status."""
    try:
        with endings_are_interrupts(), _modules_found_here():
            status = app(arguments, standalone_mode=False, prog_name=_NAME)  # Typer turns an interrupt into this status
        if status == INTERRUPTED:
            status = _complain(_INTERRUPTED, INTERRUPTED)
    except KeyboardInterrupt:  # another one, while it was turning
        status = _complain(_INTERRUPTED, INTERRUPTED)
    except TyperException as error:
        words = sys.argv[1:] if arguments is None else arguments
        status = 0 if not error.format_message() else _complain(errors.shortened(answer(error, words)), 2)
    except errors.TuckerlError as error:
        status = _complain(str(error), 2)
    except OSError as error:
        if error.errno not in FULL:
            raise
        status = _complain(f"{error.strerror}: make room on the disk, and give the same command again", 1)
    sys.exit(status if isinstance(status, int) else 0)


@contextmanager
def _modules_found_here() -> Iterator[None]:
    """Let all commands find modules in the current folder, as ``python -m`` does, after all others."""
    before, here = list(sys.path), str(Path.cwd())
    if here not in before:
        sys.path.append(here)
    try:
        yield
    finally:
        sys.path[:] = before


def _complain(message: str, status: int) -> int:
    typer.echo(f"tuckerl: {message}", err=True)
    return status
