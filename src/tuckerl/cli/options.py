"""The options that several commands take."""

from typing import Annotated

import typer

Workers = Annotated[int | None, typer.Option(help="Processes. Default: one for each core.")]
Cluster = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS", help="A Dask scheduler, such as tcp://host:8786, whose workers play the runs instead."
    ),
]
Seed = Annotated[
    int,
    typer.Option(
        help="Decides what agents and environments draw, and with it all results; not what an environment takes from "
        "elsewhere, such as the clock."
    ),
]
EnvSettings = Annotated[
    list[str] | None,
    typer.Option("--env-set", metavar="NAME=VALUE", help="A keyword of the environment; may be repeated."),
]
OverwriteStudy = Annotated[
    bool,
    typer.Option(
        "--overwrite", help="Replace another study's results in the folder, and play runs of other code again."
    ),
]
Yes = Annotated[bool, typer.Option("--yes", help="Do not ask whether very many runs are meant.")]
AcceptCode = Annotated[
    bool, typer.Option("--accept-code", help="Keep finished runs that other code, or other versions, have played.")
]
