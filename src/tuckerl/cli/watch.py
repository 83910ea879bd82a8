"""``tuckerl watch``: the report of a study that is being played, served to this machine and renewed as runs end."""

import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated

import typer

_SECONDS_BETWEEN_LOOKS = 2.0
_SHARE = 0.3  # of the time, at most, in which reports are made


def watch(
    folder: Annotated[
        Path, typer.Argument(metavar="DIR", help="The folder of a `study run`, a `reproduce` or a `compare`.")
    ],
    port: Annotated[int, typer.Option(help="Of this machine's loopback address. Default: one that is free.")] = 0,
) -> None:
    """Serve the report of the runs that are finished, on 127.0.0.1 alone; it renews itself as runs end.

    The folder is only read, also while another process plays its study. Ctrl-C ends it.
    """
    # Imported here, so that --help is quick.
    from tuckerl.cli.compare import config_of
    from tuckerl.cli.warnings import short_warnings
    from tuckerl.reports.watch_server import WatchServer
    from tuckerl.reports.watched import page_of, stamp_of, write_waiting

    write = page_of(folder, config_of)
    with short_warnings(), TemporaryDirectory() as place, WatchServer(port) as server:
        server.show(write_waiting("The report is being made.", Path(place)))
        typer.echo(f"Watching {folder} at {server.address} (Ctrl-C ends it)")
        stamp, spent = None, 0.0
        try:
            while True:
                if (now := stamp_of(folder)) != stamp:
                    begun = time.monotonic()
                    server.show(write(Path(place)))
                    stamp, spent = now, time.monotonic() - begun
                time.sleep(max(_SECONDS_BETWEEN_LOOKS, spent * (1 / _SHARE - 1)))
        except KeyboardInterrupt:  # the way to end it
            typer.echo("Not watched any more.")
