"""Which study a folder holds, as JSON, and in words what makes another study of it."""

import json
from collections.abc import Iterator
from typing import Any

from tuckerl.studies.study import Study

_FORMAT = 2
_GROWING = ("runs", "instances")  # numbers of a scenario that may grow


def study_specification(study: Study) -> dict[str, Any]:
    """Return which study it is, as JSON."""
    normal: dict[str, Any] = json.loads(json.dumps({"format": _FORMAT, **study.specification()}))
    return normal


def seeds_of(study: Study) -> dict[str, Any]:
    """Return, as JSON, what a study's specification does not say and its runs' identities need."""
    return {
        scenario.name: {
            "number": scenario.number,
            "regret": scenario.asks_regret,
            "recorded": list(scenario.record_paths_of),
        }
        for scenario in study.scenarios
    }


def changes_of_study(there: dict[str, Any], here: dict[str, Any]) -> Iterator[str]:
    """Give in words what makes one study another, and not a larger or a smaller one of the same."""
    if there["format"] != here["format"]:
        yield f"written by an older or newer tuckerl, in format {there['format']} and not {here['format']}"
        return
    yield from differences(there["seed"], here["seed"], "seed")
    for name, old in there["scenarios"].items():
        place, new = f"scenarios.{name}", here["scenarios"].get(name)
        if new is None:
            yield f"{place} is there and not in this one, which has {', '.join(here['scenarios'])}"
            continue
        but_for = ("variants", *_grown(old, new))
        yield from differences(_without(old, *but_for), _without(new, *but_for), place)
        for variant, specification in old["variants"].items():
            own = new["variants"].get(variant)
            within = f"{place}.variants.{variant}"
            if own is None:
                yield f"{within} is there and not in this one"
            else:
                yield from differences(specification, own, within)


def _grown(old: dict[str, Any], new: dict[str, Any]) -> list[str]:
    return [name for name in _GROWING if new[name] >= old[name]]


def _without(scenario: dict[str, Any], *names: str) -> dict[str, Any]:
    return {name: value for name, value in scenario.items() if name not in names}


def differences(there: Any, here: Any, place: str) -> Iterator[str]:
    """Give in words what differs between two values of JSON, `place` being where they stand."""
    if isinstance(there, dict) and isinstance(here, dict):
        for name in [*here, *(n for n in there if n not in here)]:
            inside = f"{place}.{name}" if place else name
            if name in there and name in here:
                yield from differences(there[name], here[name], inside)
            else:
                yield f"{inside} is {'there and not in' if name in there else 'not there and in'} this one"
    elif there != here:
        yield f"{place} is {json.dumps(there)} there and {json.dumps(here)} now"
