"""Small summaries made by hand: what a figure or a page shows of them is known."""

import math
from dataclasses import replace

import numpy as np
import polars as pl

from tuckerl.problems.maze import Maze, sutton_maze
from tuckerl.studies.ablation import Ablation, AblationStep, ablation_study
from tuckerl.studies.cart_pole import CART_POLE
from tuckerl.studies.claims import Claim
from tuckerl.studies.dyna_maze import DYNA_MAZE
from tuckerl.studies.robot_rescue import ROBOT_RESCUE
from tuckerl.studies.sensitivity import DEFAULT, Cell, Sensitivity
from tuckerl.studies.statistics import NO_DIFFERENCE, Band, Difference
from tuckerl.studies.study import Scenario, Study
from tuckerl.studies.summary import Curve, Path, Summary, WeightCourse
from tuckerl.studies.tables import SCHEMAS, StudyTables
from tuckerl.types import FloatArray

N_EPISODES = 20
LEVELS = (0.5, 0.4, 0.6, 0.48)  # of the first four actions' weights


def sutton(_: int) -> Maze:
    return sutton_maze()


SCENARIO = replace(DYNA_MAZE, problem=sutton, n_instances=1, n_runs=3, n_episodes=N_EPISODES)

SCENARIOS = (
    CART_POLE.resized(n_runs=3, n_episodes=N_EPISODES),
    SCENARIO,
    ROBOT_RESCUE.resized(n_runs=3, n_episodes=N_EPISODES),
)


def study_of(*scenarios: Scenario) -> Study:
    return Study(scenarios or (SCENARIO,), seed=5)


def band(mean: FloatArray, half: float = 1.0) -> Band:
    return Band(mean, mean - half, mean + half)


def summary_of(scenario: Scenario = SCENARIO, n_episodes: int = N_EPISODES) -> Summary:
    """Variant number i costs 100 - i steps in every episode."""
    names = [variant.name for variant in scenario.variants]
    episodes = np.arange(1.0, n_episodes + 1)
    curves = tuple(
        Curve(name, band((100 - i) * episodes), band(-i * episodes, i), 3, 0) for i, name in enumerate(names)
    )
    windows = np.arange(10, n_episodes + 1, 10)
    levels = [*LEVELS, *np.linspace(0.1, 0.3, scenario.algorithm.n_actions - 4)]
    weights = tuple(
        WeightCourse(name, windows, tuple(band(np.full(windows.size, level), 0.01) for level in levels))
        for name in names[1:]
    )
    maze = sutton_maze()
    states = np.array([maze.state(cell) for cell in maze.shortest_path()])
    paths = tuple(Path(name, np.insert(states, 0, states[0])) for name in scenario.record_paths_of)
    return Summary(scenario, curves, weights, paths, dict.fromkeys(names, 15.0), dict.fromkeys(names, 0.012))


def nothing_of(scenario: Scenario = SCENARIO) -> Summary:
    """Every run diverged before its first episode ended."""
    none = np.full(N_EPISODES, np.nan)
    lost = Band(none, none, none)
    names = [variant.name for variant in scenario.variants]
    curves = tuple(Curve(name, lost, lost, 0, 3) for name in names)
    paths = tuple(Path(name, np.zeros(0, dtype=np.int64)) for name in scenario.record_paths_of)
    return Summary(scenario, curves, (), paths, {}, {})


def claim(
    verdict: str = "holds",
    difference: tuple[float, float, float] = (0.1, 0.05, 0.15),
    control: tuple[float, float, float] = (0.02, -0.01, 0.05),
    claim_id: str = "C5",
    n_diverged: int = 0,
) -> Claim:
    return Claim(
        claim_id,
        f"the claim number {claim_id}",
        SCENARIO.name,
        verdict,
        3,
        "dyna-ht-1 against dyna-h; control constant-1",
        Difference(*difference, 3, n_diverged),
        Difference(*control, 3, n_diverged),
    )


def weights_claim(verdict: str = "holds") -> Claim:
    return Claim("C9", "omega is in (0, 1]", "all", verdict, 12, "96 weights")


def tables_of(scenario: Scenario = SCENARIO) -> StudyTables:
    """StudyTables as a study leaves them; run 2 of dyna-ht-1 diverged in its sixth episode."""
    rng = np.random.default_rng(1)
    runs, times = [], []
    for variant in scenario.variants:
        for run in range(scenario.n_runs):
            key = {"scenario": scenario.name, "variant": variant.name, "instance": 0, "run": run}
            times.append(key | {"agents": variant.n_agents, "seconds": 0.01})
            for agent in range(variant.n_agents):
                for episode in range(scenario.n_episodes):
                    lost = (variant.name, run) == ("dyna-ht-1", 2) and episode >= 5
                    steps = None if lost else int(rng.integers(14, 40))
                    reward = None if steps is None else 1.0 - steps
                    row = {"agent": agent, "episode": episode, "steps": steps, "return": reward, "diverged": lost}
                    runs.append(key | row)
    rows = {"runs": runs, "weights": [], "paths": [], "times": times}
    return StudyTables(**{name: pl.DataFrame(rows[name], schema=schema) for name, schema in SCHEMAS.items()})


def difference(mean: float, half: float = 0.05, n_diverged: int = 0) -> Difference:
    return Difference(mean, mean - half, mean + half, 3, n_diverged)


def ablation_of(scenario: Scenario = SCENARIO) -> Ablation:
    """The constant rate gains, random actions lose, the rest decides nothing; of two no pair is left."""
    (small,) = ablation_study(study_of(scenario), n_runs=3).scenarios
    base, *names = (variant.name for variant in small.variants)
    effects = {
        names[0]: (base, difference(0.3), difference(0.3)),
        names[1]: (names[0], difference(-0.2), difference(-0.4)),
        names[2]: (names[1], difference(-0.01), difference(0.2)),
        names[3]: (names[2], Difference(math.nan, math.nan, math.nan, 0, 3), NO_DIFFERENCE),
        names[4]: (names[2], NO_DIFFERENCE, NO_DIFFERENCE),
    }
    rest = {name: (base if name.endswith("-slow") else names[2], difference(0.02), difference(0.02)) for name in names}
    steps = (
        AblationStep(f"+ ingredient {name}", name, own, before, added)
        for name, (before, own, added) in (rest | effects).items()
    )
    return Ablation(small, tuple(steps))


def sensitivity_of() -> Sensitivity:
    """C5 holds as read, fails under one reading, has no pair left under another and was not run under a third."""
    lost = claim("not decided", (math.nan,) * 3, (math.nan,) * 3, n_diverged=3)
    cells = (
        Cell("DYNA maze", DEFAULT, claim("holds")),
        Cell("DYNA maze", DEFAULT, claim("not decided", (0.01, -0.02, 0.03), claim_id="C6")),
        Cell("DYNA maze", "other reading", claim("does not hold", (-0.4, -0.5, -0.3))),
        Cell("DYNA maze", "other reading", claim("not decided", (-0.01, -0.02, 0.03), claim_id="C6")),
        Cell("DYNA maze", "wild reading", lost),
        Cell("DYNA maze", "never run", lost._replace(difference=NO_DIFFERENCE)),
        Cell("Cart pole", DEFAULT, claim("holds", (2.0, 1.0, 3.0), claim_id="C1")),
        Cell("Cart pole", "random ties", claim("holds", (0.004, 0.001, 0.008), claim_id="C1")),
    )
    return Sensitivity(cells)
