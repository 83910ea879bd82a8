"""``tuckerl tune``: settings searched for an algorithm and for its base, and the winner tested on fresh seeds."""

import re
from pathlib import Path
from typing import Annotated

import typer

from tuckerl.cli.options import AcceptCode, Cluster, EnvSettings, OverwriteStudy, Seed, Workers, Yes


def tune(
    algorithm: Annotated[str, typer.Argument(help="An algorithm; `tuckerl list algorithms` shows them.")],
    env: Annotated[str, typer.Argument(help="Environment: its id, or MODULE:ID to import what registers it.")],
    search: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=LOW:HIGH[:log]",
            help="What to search, in the place of a default range or beside them; NAME=A,B,C are values to choose "
            "from. May be repeated.",
        ),
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set", metavar="NAME=VALUE", help="A parameter that is fixed, of the base too; may be repeated."
        ),
    ] = None,
    env_settings: EnvSettings = None,
    agents: Annotated[int | None, typer.Option(help="Agents of a T-version, instead of searching them.")] = None,
    trials: Annotated[int, typer.Option(help="Settings to try, of the algorithm and of its base each.")] = 45,
    batch: Annotated[int, typer.Option(help="Trials that are proposed together.")] = 9,
    rungs: Annotated[
        str, typer.Option(help="Runs of a batch's trials; the best third goes on from each number to the next.")
    ] = "2,6,18",
    runs: Annotated[int, typer.Option(help="Runs of each in the test of the winner.")] = 50,
    episodes: Annotated[int, typer.Option(help="Episodes of each run.")] = 500,
    measure: Annotated[
        str, typer.Option(help="return or steps of an episode, or final: the return in the last tenth of them.")
    ] = "return",
    workers: Workers = None,
    cluster: Cluster = None,
    seed: Seed = 0,
    out: Annotated[Path | None, typer.Option(help="Folder for the results. Default: one in results/tune.")] = None,
    overwrite: OverwriteStudy = False,
    accept_code: AcceptCode = False,
    yes: Yes = False,
) -> None:
    """Tune an algorithm on an environment, and its base alike; write report.html, tune.json and runs.parquet.

    The winner is tested on fresh seeds beside the tuned base and its constant control. Needs tuckerl[tune].
    """
    from tuckerl.cli.compiling import compiling_said
    from tuckerl.cli.large import ask_if_large
    from tuckerl.cli.settings import parse_numbers, parse_parameters, parse_searches, parse_settings
    from tuckerl.cli.warnings import short_warnings
    from tuckerl.reports.live_view import runs_shown
    from tuckerl.reports.tuning_page import outcome, write_tuning
    from tuckerl.studies.algorithms import check_order
    from tuckerl.studies.tuning import Tuning, TuningConfig
    from tuckerl.studies.tuning_folder import play_tuning

    check_order("tune", algorithm, env)
    given, keywords = parse_parameters(settings or ()), parse_settings(env_settings or (), "--env-set")
    searched, numbers = parse_searches(search or ()), parse_numbers(rungs, "--rungs")
    tuning = Tuning(
        TuningConfig(
            algorithm, env, keywords, searched, given, measure, agents, trials, batch, numbers, runs, episodes, seed
        )
    )
    ask_if_large(tuning.most_runs, f"{algorithm}, with all that its trials may play and its test", yes)
    folder = out or Path("results") / "tune" / re.sub(r"[^\w.-]+", "-", f"{algorithm}-{env}")
    with compiling_said(), short_warnings(), runs_shown("runs") as progress:
        result = play_tuning(
            tuning,
            folder,
            workers=workers,
            cluster=cluster,
            overwrite=overwrite,
            accept_code=accept_code,
            progress=progress,
        )
    report = write_tuning(result, folder)
    typer.echo(outcome(result))
    typer.echo(f"Report: {report}")
