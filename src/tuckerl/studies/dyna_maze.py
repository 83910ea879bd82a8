"""The paper's DYNA maze experiment (section IV.B, Figures 10 and 11) as data."""

from collections.abc import Callable

from tuckerl.adapters.resolve import Environment
from tuckerl.generalization.step import TensorStep
from tuckerl.learners.dyna_h import DynaH
from tuckerl.problems.maze import Maze, random_maze
from tuckerl.studies.study import (
    INFERRED,
    INVENTED,
    OVERRULED,
    SHARED_ASSUMPTIONS,
    AlgorithmConfig,
    Assumption,
    Comparison,
    Scenario,
    variant,
)

FAMILY = AlgorithmConfig(
    base="dyna-h",
    t_version="dyna-ht",
    learner=DynaH,
    parameters={"alpha": 0.1, "gamma": 0.95, "epsilon": 0.1, "planning_steps": 10},
    step=TensorStep(every=10, ranks=(15, 3, 9, 1), weights="paper", share="max"),
    n_actions=4,
)


def problem(instance: int) -> Maze:
    """Return the random maze of that number."""
    return random_maze(seed=instance)


def dyna_maze(
    family: AlgorithmConfig = FAMILY, problem: Callable[[int], Environment] = problem, several: int = 3
) -> Scenario:
    """Return the experiment, or the same with another family, problem or number of several agents."""
    one, more = "dyna-ht-1", f"dyna-ht-{several}"
    names = ("dyna-h", one, more, "constant-1", f"constant-{several}-max", "permuted-1", f"permuted-{several}-max")
    return Scenario(
        name="dyna-maze",
        title="DYNA maze",
        number=1,
        problem=problem,
        n_instances=10,
        n_runs=25,
        n_episodes=100,
        variants=tuple(variant(family, name) for name in names),
        comparisons=(
            Comparison("C3", "DYNA-HT finds a shorter path than DYNA-H", "path", "dyna-h", one, names[3]),
            Comparison("C4", f"{several} DYNA-HT agents find a shorter path than one", "path", one, more, names[4]),
            Comparison("C5", "DYNA-HT with one agent costs less than DYNA-H", "cost", "dyna-h", one, names[3]),
            Comparison("C6", f"{several} DYNA-HT agents cost less than one", "cost", one, more, names[4]),
        ),
        record_paths_of=("dyna-h", one, more),
        family=family,
        measure="cost",
        assumptions=(*SHARED_ASSUMPTIONS, *ASSUMPTIONS),
    )


ASSUMPTIONS = (
    Assumption(
        INFERRED, "The start is the cell (0, 3): its distance of 59 to the goal is the length of the three-agent path."
    ),
    Assumption(
        INFERRED,
        "A cell is a wall when a draw from N(0, 0.3), rounded, is not 0: 9.6 % of the cells. A maze without a path "
        "is drawn "
        "again. The ten mazes are those of the numbers 0 to 9, whatever the seed.",
    ),
    Assumption(INVENTED, "The model remembers whether an outcome ended the episode."),
    Assumption(
        OVERRULED,
        "Planning walks on from where the last planned step led; Figures 6 and 7 print no such walk. One of three "
        "public "
        "implementations does so.",
    ),
    Assumption(
        INFERRED,
        "The path of a variant is that of its shortest episode while learning goes on, in the picture the best "
        "agent's.",
    ),
)

DYNA_MAZE = dyna_maze()
