"""``tuckerl compare``: two algorithms on one environment, paired by their seeds."""

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tuckerl.cli.options import AcceptCode, Cluster, EnvSettings, OverwriteStudy, Seed, Workers, Yes

if TYPE_CHECKING:
    from tuckerl.studies.comparison import ComparisonConfig
    from tuckerl.studies.run_progress import RunProgress


def compare(
    base: Annotated[str, typer.Argument(help="An algorithm; `tuckerl list algorithms` shows them.")],
    candidate: Annotated[str, typer.Argument(help="The algorithm that is compared with it.")],
    env: Annotated[str, typer.Option(help="Environment: its id, or MODULE:ID to import what registers it.")],
    runs: Annotated[int, typer.Option(help="Runs of each, paired by their seeds.")] = 50,
    episodes: Annotated[int, typer.Option(help="Episodes of each run.")] = 500,
    agents: Annotated[int | None, typer.Option(help="Agents of a T-version. Default: 1.")] = None,
    equal_experience: Annotated[
        bool,
        typer.Option(
            "--equal-experience",
            help="Let each variant play --episodes over all its agents together, so that more agents play fewer each.",
        ),
    ] = False,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="NAME=VALUE",
            help="A parameter of both, or base.NAME or candidate.NAME; may be repeated. `tuckerl list ALGORITHM` shows "
            "an algorithm's.",
        ),
    ] = None,
    env_settings: EnvSettings = None,
    measure: Annotated[
        str, typer.Option(help="return or steps of an episode, or final: the return in the last tenth of them.")
    ] = "return",
    workers: Workers = None,
    cluster: Cluster = None,
    seed: Seed = 0,
    out: Annotated[Path | None, typer.Option(help="Folder for the results. Default: one in results/compare.")] = None,
    overwrite: OverwriteStudy = False,
    accept_code: AcceptCode = False,
    yes: Yes = False,
) -> None:
    """Compare two algorithms on an environment; write report.html, a figure, compare.json and runs.parquet.

    Where one of them is a T-version, its constant control is played as well. Finished runs in the folder are not run
    again.
    """
    # Imported here, so that --help is quick.
    from tuckerl.cli.compiling import compiling_said
    from tuckerl.cli.large import ask_if_large
    from tuckerl.cli.warnings import short_warnings
    from tuckerl.reports.comparison_page import outcome, write_comparison
    from tuckerl.reports.comparison_text import regrets_of
    from tuckerl.reports.learner_text import by_agent
    from tuckerl.reports.live_view import runs_shown
    from tuckerl.studies.comparison import comparison_study
    from tuckerl.studies.comparison_result import means_by_agent, summarise_comparison
    from tuckerl.studies.reproduce import run_study

    request = {"base": base, "candidate": candidate, "env": env, "runs": runs, "episodes": episodes, "agents": agents}
    request |= {"settings": settings or [], "env_settings": env_settings or [], "measure": measure, "seed": seed}
    request |= {"equal_experience": equal_experience}
    comparison = comparison_study(config_of(request))
    ask_if_large(comparison.study.n_runs, f"{base} and {candidate}", yes)
    folder = out or Path("results") / "compare" / re.sub(r"[^\w.-]+", "-", f"{base}-{candidate}-{env}")

    def tell(runs: "RunProgress") -> None:  # from the first call on, the folder is this comparison's
        _keep_request(request, folder)
        show(runs)

    with compiling_said(), short_warnings(), runs_shown("runs") as show:
        tables = run_study(
            comparison.study,
            folder,
            workers=workers,
            cluster=cluster,
            overwrite=overwrite,
            accept_code=accept_code,
            progress=tell,
        )
    result = summarise_comparison(comparison, tables)
    report = write_comparison(result, folder)
    typer.echo(outcome(result))
    if regrets := regrets_of(result.regrets):
        typer.echo(regrets)
    for name, means in means_by_agent(comparison, tables).items():
        typer.echo(f"Mean return of {name} by agent: {by_agent(means)}")
    typer.echo(f"Report: {report}")


def config_of(request: Mapping[str, Any]) -> "ComparisonConfig":
    """Return the comparison that a ``request.json`` asks for: what was typed, by the names of the options.

    Raises
    ------
    ParameterError, UnknownNameError
        If a setting cannot be read.
    """
    from tuckerl.cli.settings import parse_parameters, parse_settings
    from tuckerl.studies.comparison import ComparisonConfig

    return ComparisonConfig(
        request["base"],
        request["candidate"],
        request["env"],
        parse_settings(request["env_settings"], "--env-set"),
        parse_parameters(request["settings"]),
        request["measure"],
        request["agents"],
        request["runs"],
        request["episodes"],
        request["seed"],
        request.get("equal_experience", False),
    )


def _keep_request(request: Mapping[str, Any], folder: Path) -> None:
    """Write what was asked for into the folder, from which `tuckerl watch` makes the comparison again."""
    from tuckerl.files import write_whole
    from tuckerl.reports.watched import REQUEST

    content = f"{json.dumps(request, indent=1)}\n".encode()
    path = folder / REQUEST
    if not path.exists() or path.read_bytes() != content:
        write_whole(path, content)
