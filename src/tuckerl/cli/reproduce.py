"""``tuckerl reproduce``: the paper's experiments, their figures and the verdicts on its claims."""

from pathlib import Path
from typing import Annotated

import typer

from tuckerl.cli.options import AcceptCode, Cluster, OverwriteStudy, Seed, Workers, Yes


def reproduce(
    scenario: Annotated[str, typer.Argument(help="A scenario, which `tuckerl list scenarios` shows, or all.")] = "all",
    runs: Annotated[int | None, typer.Option(help="Runs of each instance. Default: the paper's.")] = None,
    episodes: Annotated[int | None, typer.Option(help="Episodes of each run. Default: the paper's.")] = None,
    workers: Workers = None,
    cluster: Cluster = None,
    seed: Seed = 0,
    out: Annotated[
        Path | None, typer.Option(help="Folder for the results. Default: results/paper, or results/quick with --quick.")
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="A small version of everything.")] = False,
    sensitivity: Annotated[
        bool, typer.Option("--sensitivity", help="Test the claims under other readings of the paper, too.")
    ] = False,
    overwrite: OverwriteStudy = False,
    accept_code: AcceptCode = False,
    yes: Yes = False,
) -> None:
    """Run the paper's experiments; write report.html, figures, claims.json and runs.parquet.

    Finished runs in the folder are not run again.
    """
    # Imported here, so that --help is quick.
    from tuckerl.cli.compiling import compiling_said
    from tuckerl.cli.large import ask_if_large
    from tuckerl.cli.warnings import short_warnings
    from tuckerl.progress import default_workers
    from tuckerl.reports.live_view import runs_shown
    from tuckerl.reports.report import write_report
    from tuckerl.reports.verdicts import verdict_table
    from tuckerl.studies.ablation import ablation_study, ablations
    from tuckerl.studies.reproduce import play_study, player_of
    from tuckerl.studies.scenarios import QUICK_RUNS, scenario_study
    from tuckerl.studies.sensitivity import Sensitivity, estimated_seconds, sensitivity_study, summarise_sensitivity
    from tuckerl.studies.study import Study
    from tuckerl.studies.summary import summarise
    from tuckerl.studies.tables import StudyTables

    folder = out or Path("results") / ("quick" if quick else "paper")

    def play(part: Study, where: Path, label: str) -> StudyTables:
        with compiling_said(), short_warnings(), runs_shown(label) as progress:
            return play_study(part, where, player, overwrite=overwrite, accept_code=accept_code, progress=progress)

    study = scenario_study(scenario, runs=runs, episodes=episodes, seed=seed, quick=quick)
    ask_if_large(study.n_runs, scenario, yes)
    small, cells = ablation_study(study), Sensitivity()
    with player_of(workers, cluster) as player:
        tables = play(study, folder, "runs")
        taken_apart = ablations(small, play(small, folder / "ablation", "ablation").runs)
        if sensitivity:
            others = sensitivity_study(study, QUICK_RUNS if quick and runs is None else runs)
            n_workers = workers or (1 if cluster else default_workers())
            minutes = estimated_seconds(others, tables.times, n_workers) / 60
            typer.echo(f"Other readings of the paper: about {minutes:.0f} minutes with {n_workers} workers.", err=True)
            cells = summarise_sensitivity(others, play(others, folder / "sensitivity", "other readings").runs)
    claims, summaries = summarise(study, tables)
    report = write_report(study, claims, summaries, folder, ablations=taken_apart, sensitivity=cells)
    typer.echo(f"{verdict_table(claims)}\nReport: {report}")
