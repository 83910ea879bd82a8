"""``tuckerl list``: what there is to name on the command line."""

from collections.abc import Callable
from typing import Annotated, NamedTuple

import typer
from rich.console import Console
from rich.table import Table

from tuckerl.checks import check_name

Rows = list[tuple[str, ...]]


# What is listed is imported in each function, so that --help is quick.
def _algorithms() -> Rows:
    from tuckerl.studies.algorithms import ALGORITHMS

    return [(one.name, one.title, one.source) for one in ALGORITHMS.values()]


def _environments() -> Rows:
    from tuckerl.studies.environments import listed_environments

    return [(one.name, one.title, one.how) for one in listed_environments()]


def _scenarios() -> Rows:
    from tuckerl.studies.scenarios import SCENARIOS

    return [(one.name, one.description) for one in SCENARIOS.values()]


def _weights() -> Rows:
    from tuckerl.generalization.weights import WEIGHTINGS

    return [(name, weighting.description) for name, weighting in WEIGHTINGS.items()]


def _shares() -> Rows:
    from tuckerl.generalization.sharing import SHARING_RULES

    return [(name, rule.description) for name, rule in SHARING_RULES.items()]


class Listing(NamedTuple):
    """A kind of names: the titles of its columns, and its rows."""

    titles: tuple[str, ...]
    rows: Callable[[], Rows]


LISTINGS = {
    "algorithms": Listing(("Name", "Algorithm", "Source"), _algorithms),
    "environments": Listing(("Id", "Environment", "How it is played"), _environments),
    "scenarios": Listing(("Name", "Experiment"), _scenarios),
    "weights": Listing(("Name", "The learning rate of an action is multiplied by"), _weights),
    "shares": Listing(("Name", "After a window, all agents go on with"), _shares),
}

_OTHERS = (
    "Any other id that is registered with Gymnasium, or with PettingZoo as a parallel environment, can be named too; "
    "MODULE:ID imports the module that registers it first."
)


def list_names(kind: Annotated[str, typer.Argument(help=f"{', '.join(LISTINGS)} or all.")] = "all") -> None:
    """List algorithms, environments, scenarios, weights and sharing rules by name.

    Tables on a terminal; elsewhere a line each, its columns apart by tabs and the name first.
    """
    check_name("kind", kind, (*LISTINGS, "all"))
    console = Console()
    for chosen in LISTINGS if kind == "all" else (kind,):
        titles, rows = LISTINGS[chosen]
        if not console.is_terminal:
            for row in rows():
                typer.echo("\t".join(row))
            continue
        table = Table(*titles, title=chosen.capitalize(), title_justify="left", title_style="bold")
        for row in rows():
            table.add_row(*row)
        console.print(table)
    if console.is_terminal and kind in ("environments", "all"):
        console.print(_OTHERS)
