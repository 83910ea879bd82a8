"""``tuckerl list``: what there is to name on the command line."""

from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from tuckerl.checks import check_name

Rows = list[tuple[str, ...]]
KINDS = ("algorithms", "environments", "weights", "shares")


def list_names(
    kind: Annotated[str, typer.Argument(help="algorithms, environments, weights, shares or all.")] = "all",
) -> None:
    """List algorithms, environments, weights and sharing rules by name.

    Tables on a terminal; elsewhere a line each, its columns apart by tabs and the name first.
    """
    check_name("kind", kind, (*KINDS, "all"))
    console = Console()
    for chosen in KINDS if kind == "all" else (kind,):
        titles, rows = _SHOWN[chosen]()
        if not console.is_terminal:
            for row in rows:
                typer.echo("\t".join(row))
            continue
        table = Table(*titles, title=chosen.capitalize(), title_justify="left", title_style="bold")
        for row in rows:
            table.add_row(*row)
        console.print(table)
    if console.is_terminal and kind in ("environments", "all"):
        console.print(_OTHERS)


_OTHERS = (
    "Any other id that is registered with Gymnasium, or with PettingZoo as a parallel environment, can be named too; "
    "MODULE:ID imports the module that registers it first."
)


def _algorithms() -> tuple[tuple[str, ...], Rows]:
    # Imported here, so that --help is quick.
    from tuckerl.studies.algorithms import ALGORITHMS

    return ("Name", "Algorithm", "Source"), [(a.name, a.title, a.source) for a in ALGORITHMS.values()]


def _environments() -> tuple[tuple[str, ...], Rows]:
    from tuckerl.studies.environments import listed_environments

    return ("Id", "Environment", "How it is played"), [(e.name, e.title, e.how) for e in listed_environments()]


def _weights() -> tuple[tuple[str, ...], Rows]:
    from tuckerl.generalization.weights import WEIGHTINGS

    told = [(name, weighting.description) for name, weighting in WEIGHTINGS.items()]
    return ("Name", "The learning rate of an action is multiplied by"), list(told)


def _shares() -> tuple[tuple[str, ...], Rows]:
    from tuckerl.generalization.sharing import SHARING_RULES

    return ("Name", "After a window, all agents go on with"), [
        (name, rule.description) for name, rule in SHARING_RULES.items()
    ]


_SHOWN = {"algorithms": _algorithms, "environments": _environments, "weights": _weights, "shares": _shares}
