"""How far the study in a folder is, by what the folder itself says: whichever command made it, a tuning, too."""

import json
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

from tuckerl.errors import OutputError, ParameterError
from tuckerl.studies.parts import Parts
from tuckerl.studies.runs import Run, decided_alike, identities_alike

_LOOKS = 10


class ScenarioStatus(NamedTuple):
    """How far a scenario of a study is."""

    name: str
    n_variants: int
    n_runs: int  # in all
    n_finished: int
    n_failed: int  # that ended with an error when they were last played


def identities_of(held: Mapping[str, Any]) -> Iterator[tuple[Run, str]]:
    """Give the identity of each run of the study that a folder's ``study.json`` holds, as `run_identities` does."""
    for name, scenario in held["scenarios"].items():
        seeds = held["seeds"][name]
        problem, seed = scenario.get("environment") or name, [held["seed"], seeds["number"]]
        for variant, specification in scenario["variants"].items():
            decided = decided_alike(problem, scenario["episodes"], seed, specification, regret=seeds["regret"])
            sizes = scenario["instances"], scenario["runs"]
            yield from identities_alike(name, variant, sizes, decided, recorded=variant in seeds["recorded"])


def folder_status(folder: Path) -> list[ScenarioStatus]:
    """Return how far each scenario is of the study that a folder of results holds.

    It only looks, also while another process plays there. Runs count that any code has played.

    Raises
    ------
    ParameterError
        If it holds none, or one of another version.
    OutputError
        If it cannot be read.
    """
    try:
        held = json.loads((folder / "study.json").read_bytes())
        identities = dict(identities_of(held))
    except FileNotFoundError as error:
        raise ParameterError(f"{folder} holds no results: there is no study.json in it") from error
    except OSError as error:
        raise OutputError(f"cannot read {folder}: {error.strerror or error}") from error
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        raise ParameterError(
            f"the study.json in {folder} is not one that this version of tuckerl has written: give the command that "
            "made the folder again, which says what differs"
        ) from error
    stored, failed = _stored(folder)
    scenarios = []
    for name, scenario in held["scenarios"].items():
        own = [identity for run, identity in identities.items() if run.scenario == name]
        counts = (sum(one in found for one in own) for found in (stored, failed))
        scenarios.append(ScenarioStatus(name, len(scenario["variants"]), len(own), *counts))
    return scenarios


def _stored(folder: Path) -> tuple[set[str], set[str]]:
    """Return the identities of all runs that are finished, and of those that failed when they were last played."""
    try:
        for _ in range(_LOOKS):
            with suppress(FileNotFoundError):  # another process has just put several parts into one
                return _looked(folder)
        return _looked(folder)
    except OSError as error:
        raise OutputError(f"cannot read {folder}: {error.strerror or error}") from error


def _looked(folder: Path) -> tuple[set[str], set[str]]:
    return set(Parts(folder / "parts").stored), {path.stem for path in (folder / "failures").glob("*.txt")}
