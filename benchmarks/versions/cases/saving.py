"""Learners that are saved, loaded and gone on with: by the same version, by the next one, and from kept files."""

import hashlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import tuckerl
from benchmarks.versions.cases import plain, stepped
from benchmarks.versions.cases.case import VARIANTS, Case, Folders, World, evaluated, named
from benchmarks.versions.cases.tensor_steps import own_share, own_weights, step
from benchmarks.versions.cases.worlds import Party, Wander, drift
from benchmarks.versions.names import Arrays, recorded

SAVED, MORE = 7, 12
"""Episodes before saving, in the midst of a window, and after it."""


class Place(NamedTuple):
    """Where learners are saved."""

    world: World
    parameters: dict[str, Any]
    is_in_file: bool  # whether the file knows all of the problem


WORLDS = {
    "a random table": Place(plain.WORLDS["a random table with masks"], {"n_agents": 2}, True),
    "a random table, tensor step": Place(
        plain.WORLDS["a random table with masks"],
        {"n_agents": 2, "tensor_step": step(every=4), "epsilon": tuckerl.Exponential(0.9, 0.9, 0.05)},
        True,
    ),
    "a random table, own functions": Place(
        plain.WORLDS["a random table"],
        {"n_agents": 3, "tensor_step": step(every=4, weights=own_weights, share=own_share), "initial_q": 0.5},
        True,
    ),
    "Sutton's maze": Place(plain.WORLDS["Sutton's maze"], {"alpha": tuckerl.Harmonic(0.5, 20), "n_agents": 2}, True),
    "cart pole": Place(plain.WORLDS["cart pole, uniform start"], {"tensor_step": step(every=3)}, False),
    "drift": Place(plain.WORLDS["drift"], {"n_agents": 2, "ties": "first"}, False),
    "MountainCar-v0": Place(stepped.WORLDS["MountainCar-v0"], {}, True),
    "Taxi-v4, stepped": Place(stepped.WORLDS["Taxi-v4, stepped"], {"bootstrap_terminal": True}, True),
    "a ring with masks": Place(
        stepped.WORLDS["a ring with masks"], {"n_agents": 2, "tensor_step": step(every=4, floor=0.1)}, False
    ),
}
PLAYERS = {
    "robot rescue, tables apart": Place(stepped.PLAYERS["robot rescue, tables apart"], {}, True),
    "a party with masks": Place(stepped.PLAYERS["a party with masks"], {"tensor_step": step(every=3)}, False),
}
TEAMS = {
    "robot rescue, a team": Place(stepped.TEAMS["robot rescue, a team"], {}, True),
    "robot rescue, lifted": Place(stepped.TEAMS["robot rescue, lifted"], {}, True),
    "a party, joined": Place(stepped.TEAMS["a party, joined"], {"tensor_step": step(every=4)}, False),
}

KEPT: dict[str, Callable[[], Any] | None] = {
    "format1_q_learning": None,
    "format1_sarsa": None,
    "format1_sarsa_lambda": drift,
    "format1_dyna_h": None,
    "format1_team_q": None,
    "format2_lifted": None,
    "format2_masked": None,
    "format2_dyna": None,
    "format2_team": None,
    "format2_simulator": drift,
    "format2_generator": lambda: Wander(6, 3),
    "format2_reseeded": lambda: Wander(6, 4, masked=True, keeps_generator=False),
    "format2_identified": None,
    "format2_binned": None,
    "format2_players": lambda: Party({"a": 2, "b": 1, "c": 3}, 4, 2),
    "format2_masked_players": lambda: Party({"first": 4, "second": 4}, 5, 3, masked=True),
    "format2_joint": lambda: tuckerl.JointEnv(Party({"left": 10, "right": 10}, 6, 6, truncated=True)),
}
"""Files that were kept, and what their learners go on with where the file does not hold it: the same sizes suffice."""


def cases() -> Iterator[Case]:
    """Give all cases of this module; each file is written before it is read."""
    for what, (kind, parameters) in VARIANTS.items():
        for where, place in {**WORLDS, **(TEAMS if kind == "TeamQ" else PLAYERS)}.items():
            name = f"{what} on {where}"
            chosen = parameters | place.parameters
            yield _saved(name, place, kind, chosen)
            yield _handed_over(name, place)
    for name, make in KEPT.items():
        yield _kept(name, make)


def _file(folder: Path, name: str) -> Path:
    return folder / f"{hashlib.sha256(name.encode()).hexdigest()[:16]}.tuckerl"


def _saved(name: str, place: Place, kind: str, parameters: dict[str, Any]) -> Case:
    def record(folders: Folders) -> Arrays:
        learner = place.world.learner(kind, name, **parameters).learn(SAVED)
        path = _file(folders.own, name)
        learner.save(path)
        return named("unbroken", recorded(learner.learn(MORE))) | _gone_on(path, place)

    return Case(f"saved: {name}", record)


def _handed_over(name: str, place: Place) -> Case:
    return Case(f"handed over: {name}", lambda folders: _gone_on(_file(folders.old, name), place))


def _gone_on(path: Path, place: Place) -> Arrays:
    """Load a learner and go on; its evaluation and its actions draw from streams that are kept, too."""
    given: dict[str, Any] = {} if place.is_in_file else {"env": place.world.make()}
    tensor_step = place.parameters.get("tensor_step")
    if tensor_step is not None and callable(tensor_step.weights):
        given["tensor_step"] = tensor_step
    learner = tuckerl.load(path, **given)
    loaded = named("loaded", recorded(learner) | place.world.actions(learner) | evaluated(learner, 3))
    return loaded | recorded(learner.learn(MORE))


def _kept(name: str, make: Callable[[], Any] | None) -> Case:
    def record(folders: Folders) -> Arrays:
        learner = tuckerl.load(folders.kept / f"{name}.tuckerl", env=None if make is None else make())
        return named("loaded", recorded(learner)) | recorded(learner.learn(MORE))

    return Case(f"kept: {name}", record)
