"""``tuckerl list``: what there is to name on the command line."""

from typing import Annotated, Any, NamedTuple

import typer
from rich.console import Console
from rich.table import Table
from rich.text import Text

from tuckerl.checks import check_name
from tuckerl.registers import load


class Listing(NamedTuple):
    """A kind of names, and the table that shows it."""

    home: str  # of what is listed, by name, or of a function that returns it; loaded late, so that --help is quick
    columns: dict[str, str]  # the titles of the columns after the name's, by the attributes that they show
    name: str = "Name"
    of: Any = None  # what the function is given

    def rows(self) -> list[list[str]]:
        """Return the table's rows."""
        found = load(self.home)
        listed = found if not callable(found) else found() if self.of is None else found(self.of)
        return [[name, *(getattr(one, attribute) for attribute in self.columns)] for name, one in listed.items()]


LISTINGS = {
    "algorithms": Listing("tuckerl.studies.algorithms:ALGORITHMS", {"title": "Algorithm", "source": "Source"}),
    "environments": Listing(
        "tuckerl.studies.environments:listed_environments", {"title": "Environment", "how": "How it is played"}, "Id"
    ),
    "scenarios": Listing("tuckerl.studies.scenarios:SCENARIOS", {"description": "Experiment"}),
    "policies": Listing("tuckerl.training.policies:POLICIES", {"description": "How actions are chosen"}),
    "weights": Listing(
        "tuckerl.generalization.weights:WEIGHTINGS", {"description": "The learning rate of an action is multiplied by"}
    ),
    "shares": Listing(
        "tuckerl.generalization.sharing:SHARING_RULES", {"description": "After a window, all agents go on with"}
    ),
}

_PARAMETERS = Listing(
    "tuckerl.studies.parameter_docs:parameter_docs", {"default": "Default", "kind": "Value", "meaning": "Meaning"}
)

_OTHERS = (
    "Any other id that is registered with Gymnasium, or with PettingZoo as a parallel environment, can be named too; "
    "MODULE:ID imports the module that registers it first."
)


def _chosen(kind: str) -> dict[str, Listing]:
    """Return what is to be listed, under the titles of its tables."""
    if kind in LISTINGS or kind == "all":
        return LISTINGS if kind == "all" else {kind: LISTINGS[kind]}
    algorithms = load(LISTINGS["algorithms"].home)
    check_name("kind", kind, (*LISTINGS, "all", *algorithms))
    return {f"parameters of {kind}, for --set": _PARAMETERS._replace(of=algorithms[kind])}


def list_names(
    kind: Annotated[
        str, typer.Argument(help=f"{', '.join(LISTINGS)} or all; or an algorithm: its parameters.")
    ] = "all",
) -> None:
    """List all that can be named: algorithms, environments, scenarios, policies, ...; or an algorithm's parameters.

    Tables on a terminal; elsewhere a line each, its columns apart by tabs and the name first.
    """
    console = Console()
    for chosen, listing in _chosen(kind).items():
        if not console.is_terminal:
            for row in listing.rows():
                typer.echo("\t".join(row))
            continue
        table = Table(
            listing.name, *listing.columns.values(), title=chosen.capitalize(), title_justify="left", title_style="bold"
        )
        for row in listing.rows():
            table.add_row(*map(Text, row))
        console.print(table)
    if console.is_terminal and kind in ("environments", "all"):
        console.print(_OTHERS)
