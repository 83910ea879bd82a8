"""Tuning in a folder, going on where an earlier call stopped, and what came of it."""

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from tuckerl.errors import ProblemError
from tuckerl.studies.comparison_result import Compared
from tuckerl.studies.estimates import reached_of
from tuckerl.studies.grid import in_a_name
from tuckerl.studies.reproduce import Progress, play_study, player_of
from tuckerl.studies.runs import all_runs
from tuckerl.studies.search_space import Range, Searched
from tuckerl.studies.store import Results
from tuckerl.studies.study import Study
from tuckerl.studies.study_result import ProblemResult, summarise_study
from tuckerl.studies.tables import StudyTables
from tuckerl.studies.tuning import Search, Trial, Tuned, Tuning, TuningConfig, is_rung


class TuningResult(NamedTuple):
    """What came of a tuning: both searches, and the test of the winner."""

    config: TuningConfig
    tuned: Tuned
    test: ProblemResult

    @property
    def compared(self) -> Compared:
        """The winner beside the tuned base and its control, on fresh seeds."""
        return self.test.comparisons[0]

    def to_dict(self) -> dict[str, Any]:
        """Return the content of ``tune.json``."""
        config = self.config
        environment = {"environment": config.environment, "environment_keywords": dict(config.keywords)}
        numbers = {
            "trials": config.n_trials,
            "batch": config.batch,
            "rungs": list(config.rungs),
            "episodes": config.n_episodes,
            "seed": config.seed,
        }
        searches = [_search_entry(search) for search in self.tuned.searches]
        variants = [estimate.to_dict() for estimate in self.test.estimates]
        return environment | numbers | {"searches": searches, "test": self.compared.to_dict() | {"variants": variants}}


def _search_entry(search: Search) -> dict[str, Any]:
    return {
        "algorithm": search.space.algorithm.name,
        "searched": {name: in_words_of_search(one) for name, one in search.space.searched.items()},
        "fixed": {name: in_a_name(value) for name, value in search.space.fixed.items()},
        "winner": search.winner().name,
        "trials": [_trial_entry(trial) for trial in search.trials],
    }


def _trial_entry(trial: Trial) -> dict[str, Any]:
    means = {str(runs): None if math.isnan(mean) else mean for runs, mean in trial.means.items()}
    return {"variant": trial.name, "batch": trial.batch, "means": means}


def outcome_in(folder: Path, scenarios: Sequence[str]) -> list[str]:
    """Return which settings a folder's tuning has found, or that it goes on; nothing where there is no tuning."""
    if not any(is_rung(name) for name in scenarios):
        return []
    try:
        searches = json.loads((folder / "tune.json").read_bytes())["searches"]
        return [f"Of {len(one['trials'])} trials of {one['algorithm']}, {one['winner']} was best." for one in searches]
    except (OSError, ValueError, KeyError, TypeError):
        return ["The tuning is not finished: it adds trials and rungs as it goes on, when its command is given again."]


def in_words_of_search(one: Searched) -> str:
    """Return a range or choices as ``--search`` takes them."""
    if isinstance(one, Range):
        return f"{one.low:g}:{one.high:g}{':log' if one.log else ''}"
    return ",".join(in_a_name(value) for value in one.values)


def play_tuning(
    tuning: Tuning,
    folder: Path,
    *,
    workers: int | None = None,
    cluster: str | None = None,
    overwrite: bool = False,
    accept_code: bool = False,
    progress: Progress | None = None,
) -> TuningResult:
    """Tune in a folder and test the winner; finished runs there are not played again.

    The folder's study grows by rungs and variants until it holds the test too. What is finished is read and decides
    again what it decided before, until something is missing: so an interrupt or a kill changes nothing.

    Parameters
    ----------
    tuning : Tuning
    folder : Path
    workers, cluster, overwrite, accept_code, progress
        As of :func:`~tuckerl.studies.reproduce.run_study`.

    Raises
    ------
    OutputError, OutputConflictError, WorkerError, MissingExtraError
        As of :func:`~tuckerl.studies.reproduce.run_study`.
    ProblemError
        If a run ended with an error: settings cannot be judged then.
    ParameterError
        If all trials diverged.
    """

    def run(study: Study) -> StudyTables:
        tables = play_study(study, folder, player, overwrite=overwrite, accept_code=accept_code, progress=progress)
        failures = Results(folder, study).failures()
        if failures:
            run, path = next(iter(failures.items()))
            raise ProblemError(
                f"runs ended with an error, so that no settings can be chosen: such as {run.variant}, run {run.run}; "
                f"the tracebacks are in {path.parent}, and the same command plays them again"
            )
        return tables

    def play(study: Study) -> StudyTables:
        # An earlier call may have come further: the folder is not asked to hold less than it does.
        results = Results(folder, study, any_code=not overwrite)
        return results.tables if len(results.finished()) == len(all_runs(study)) else run(study)

    with player_of(workers, cluster) as player:
        tuned = tuning.search(play)
        tables = run(tuned.study)
    test = Study((tuned.test,), tuned.study.seed)
    (result,) = summarise_study(test, reached_of(test, tables))
    return TuningResult(tuning.config, tuned, result)
