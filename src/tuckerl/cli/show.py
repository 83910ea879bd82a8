"""``tuckerl show``: what is in a saved agent, or in a tensor of Q-tables."""

from pathlib import Path
from typing import Annotated

import typer

from tuckerl.cli.options import EnvSettings


def show(
    file: Annotated[
        Path, typer.Argument(help="A saved agent or its folder, or a (state, action, episode, agent) .npy or .npz.")
    ],
    out: Annotated[Path | None, typer.Option(help="Folder for the page. Default: one in results/show.")] = None,
    layout: Annotated[
        str | None, typer.Option(metavar="ROWS,COLUMNS", help="The grid whose cells are the states, row by row.")
    ] = None,
    ranks: Annotated[
        str | None,
        typer.Option(metavar="RANKS", help="A,B,C,D, auto or a share such as 0.95, of a tensor. An agent has its own."),
    ] = None,
    env: Annotated[
        str | None, typer.Option(help="What an agent learned on, where the file and run.json do not say.")
    ] = None,
    env_settings: EnvSettings = None,
) -> None:
    """Inspect a file: write inspect.html and figures of the policy, the values, the loadings and the windows."""
    # Imported here, so that --help is quick.
    from tuckerl.cli.settings import parse_numbers, parse_settings, parse_value
    from tuckerl.cli.warnings import short_warnings
    from tuckerl.reports.inspect.file import inspect_file
    from tuckerl.reports.inspect.page import write_inspection
    from tuckerl.studies.training_folder import agent_at

    shape = None if layout is None else parse_numbers(layout, "--layout", 2)
    asked = None if ranks is None else parse_value(ranks)
    file = agent_at(file)
    with short_warnings():
        inspection, lines = inspect_file(file, shape, asked, env, parse_settings(env_settings or (), "--env-set"))
    name = file.resolve().parent.name if file.name == "agent.tuckerl" else file.stem
    page = write_inspection(inspection, out or Path("results") / "show" / name)
    typer.echo("\n".join(lines))
    typer.echo(f"Page: {page}")
