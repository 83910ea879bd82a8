"""The claims under other readings of the paper, one changed at a time.

Each *alternative* is a scenario with one thing changed, played by the variants that the scenario's claims compare, on
the same seeds as the reading that is the default. Nothing here is tuned: the alternatives are those that stand beside
the defaults in the project's reading of the paper.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, NamedTuple

import polars as pl

from tuckerl.adapters.resolve import Environment
from tuckerl.environments import cart_pole as cart_poles
from tuckerl.environments import robot_rescue as rescues
from tuckerl.problems.maze import random_maze
from tuckerl.problems.mdp import TabularMDP
from tuckerl.problems.simulator import Simulator
from tuckerl.studies.cart_pole import cart_pole
from tuckerl.studies.claims import Claim, compared_claims
from tuckerl.studies.dyna_maze import dyna_maze
from tuckerl.studies.robot_rescue import robot_rescue
from tuckerl.studies.study import Scenario, Study

N_INSTANCES = 3
N_RUNS = {"cart-pole": 20, "dyna-maze": 8, "robot-rescue": 20}
DEFAULT = "as read"


def cart_pole_with(instance: int, **changes: Any) -> Simulator:
    """Return a cart pole with other parameters."""
    return cart_poles.cart_pole(**changes)


def maze_with(instance: int, metric: str) -> TabularMDP:
    """Return a maze with another heuristic."""
    maze = random_maze(seed=instance)
    mdp = maze.to_mdp()
    return TabularMDP.from_arrays(mdp.arrays, mdp.n_states, maze.heuristic(metric))  # type: ignore[arg-type]  # a name


def rescue_with(instance: int, **changes: Any) -> TabularMDP:
    """Return a rescue world with other parameters."""
    return rescues.robot_rescue(**changes)


@dataclass(frozen=True)
class Alternative:
    """One change to a scenario."""

    label: str
    parameters: Mapping[str, Any] = field(default_factory=dict)  # of the learner
    step: Mapping[str, Any] = field(default_factory=dict)  # of the tensor step
    problem: Callable[[int], Environment] | None = None
    several: int | None = None  # agents, where the default is 3; in robot rescue teams, where it is 1


_HOSVD = Alternative("truncated HOSVD", step={"max_iterations": 0})
_SEVERAL = (Alternative("2 agents for several", several=2), Alternative("5 agents for several", several=5))

ALTERNATIVES: dict[str, tuple[Alternative, ...]] = {
    "cart-pole": (
        Alternative(DEFAULT),
        Alternative("accumulating traces", {"trace": "accumulating"}),
        Alternative("traces carried over", {"carry_trace": True}),
        Alternative(
            "bootstrap at failure",
            {"bootstrap_terminal": True},
            problem=partial(cart_pole_with, absorbing=False),  # else there is nothing in a failure's row
        ),
        Alternative("random start", problem=partial(cart_pole_with, start="uniform")),
        Alternative("reward +1 / -1", problem=partial(cart_pole_with, reward="sign")),
        Alternative("random ties", {"ties": "random"}),
        _HOSVD,
        *_SEVERAL,
    ),
    "dyna-maze": (
        Alternative(DEFAULT),
        Alternative("Euclidean heuristic", problem=partial(maze_with, metric="euclidean")),
        Alternative("L1 heuristic", problem=partial(maze_with, metric="l1")),
        Alternative("planning restarts", {"search_control": "restart"}),
        Alternative("planning anywhere", {"search_control": "random"}),
        Alternative("50 planning steps", {"planning_steps": 50}),
        Alternative("first tie", {"ties": "first"}),
        _HOSVD,
        *_SEVERAL,
    ),
    "robot-rescue": (
        Alternative(DEFAULT),
        Alternative("step cost 0.1", problem=partial(rescue_with, step_cost=0.1)),
        Alternative("step cost 1", problem=partial(rescue_with, step_cost=1.0)),
        Alternative("traces not cut", {"cut_traces": False}),
        Alternative("the team explores as one", {"exploration": "joint"}),
        Alternative("accumulating traces", {"trace": "accumulating"}),
        Alternative("traces carried over", {"carry_trace": True}),
        Alternative("first tie", {"ties": "first"}),
        _HOSVD,
        Alternative("2 teams", several=2),
        Alternative("3 teams", several=3),
    ),
}

_MAKERS = {"cart-pole": cart_pole, "dyna-maze": dyna_maze, "robot-rescue": robot_rescue}


class Cell(NamedTuple):
    """A claim under one alternative."""

    scenario: str
    alternative: str
    claim: Claim


def sensitivity_study(study: Study, runs: int | None = None) -> Study:
    """Return the study of all alternatives to the scenarios of `study`, with `runs` runs each."""
    made = [
        _scenario(scenario, alternative, runs)
        for scenario in study.scenarios
        for alternative in ALTERNATIVES[scenario.name]
    ]
    return Study(tuple(made), study.seed)


def sensitivity(study: Study, runs: pl.DataFrame) -> list[Cell]:
    """Return every claim under every alternative from the runs of a study that `sensitivity_study` made."""
    cells = []
    for scenario in study.scenarios:
        name, alternative = scenario.name.split(": ")
        cells += [Cell(name, alternative, claim) for claim in compared_claims(study, scenario, runs)]
    return cells


def estimated_seconds(study: Study, times: pl.DataFrame, workers: int) -> float:
    """Return about how long the study of all alternatives takes, from the times of the study it varies."""
    means = times.group_by("scenario", "variant").agg(pl.col("seconds").mean())
    known = {(scenario, variant): seconds for scenario, variant, seconds in means.iter_rows()}
    total = 0.0
    for scenario in study.scenarios:
        name = scenario.name.split(": ")[0]
        longest = max(seconds for (where, _), seconds in known.items() if where == name)
        played = sum(known.get((name, variant.name), longest) for variant in scenario.variants)
        total += played * scenario.n_instances * scenario.n_runs
    return total / workers


def _scenario(scenario: Scenario, alternative: Alternative, runs: int | None) -> Scenario:
    make = _MAKERS[scenario.name]
    family = replace(
        scenario.family,
        parameters={**scenario.family.parameters, **alternative.parameters},
        step=replace(scenario.family.step, **alternative.step),
    )
    several = {} if alternative.several is None else {"several": alternative.several}
    made = make(family, alternative.problem or scenario.problem, **several)
    compared = {n for c in made.comparisons for n in (c.base, c.candidate, c.control)}
    n_runs = min(scenario.n_runs, N_RUNS[scenario.name]) if runs is None else runs
    return replace(
        made.resized(min(scenario.n_instances, N_INSTANCES), n_runs, scenario.n_episodes),
        name=f"{scenario.name}: {alternative.label}",
        variants=tuple(v for v in made.variants if v.name in compared),
        record_paths_of=(),
    )
