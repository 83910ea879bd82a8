"""The paper's DYNA maze experiment (section IV.B, Figures 10 and 11) as data."""

from tuckerl.generalization.step import TensorStep
from tuckerl.learners.dyna_h import DynaH
from tuckerl.problems.maze import Maze, random_maze
from tuckerl.studies.study import Comparison, Family, Scenario, variant

FAMILY = Family(
    base="dyna-h",
    t_version="dyna-ht",
    learner=DynaH,
    parameters={"alpha": 0.1, "gamma": 0.95, "epsilon": 0.1, "planning_steps": 10},
    step=TensorStep(every=10, ranks=(15, 3, 9, 1), weights="paper", share="max"),
)


def problem(instance: int) -> Maze:
    """Return the random maze of that number."""
    return random_maze(seed=instance)


DYNA_MAZE = Scenario(
    name="dyna-maze",
    title="DYNA maze",
    number=1,
    problem=problem,
    n_instances=10,
    n_runs=25,
    n_episodes=100,
    variants=tuple(
        variant(FAMILY, name)
        for name in (
            "dyna-h",
            "dyna-ht-1",
            "dyna-ht-3",
            "constant-1",
            "constant-3-max",
            "permuted-1",
            "permuted-3-max",
        )
    ),
    comparisons=(
        Comparison("C3", "DYNA-HT finds a shorter path than DYNA-H", "path", "dyna-h", "dyna-ht-1", "constant-1"),
        Comparison(
            "C4",
            "three DYNA-HT agents find a shorter path than one",
            "path",
            "dyna-ht-1",
            "dyna-ht-3",
            "constant-3-max",
        ),
        Comparison("C5", "DYNA-HT with one agent costs less than DYNA-H", "cost", "dyna-h", "dyna-ht-1", "constant-1"),
        Comparison("C6", "three DYNA-HT agents cost less than one", "cost", "dyna-ht-1", "dyna-ht-3", "constant-3-max"),
    ),
    pictured=("dyna-h", "dyna-ht-1", "dyna-ht-3"),
    assumptions=(
        "The start is the cell (0, 3), whose distance of 59 to the goal is the length of the paper's three-agent path.",
        "A cell is a wall when a draw from N(0, 0.3), rounded, is not 0: 9.6 % of the cells. A maze without a path is "
        "drawn again. The ten mazes are those of the numbers 0 to 9.",
        "The step into the goal pays 0, every other -1. An episode is cut off after 2000 steps, from which it still "
        "bootstraps. There are 100 episodes.",
        "H is the squared Euclidean distance to the goal; ten planning steps follow each real one and walk on from the "
        "current state, where the figures print no such walk.",
        "Tables begin at zero; ties among greedy actions are broken at random; the model remembers whether an outcome "
        "ended the episode.",
        "The decomposition is Tucker3 by alternating least squares started from the truncated HOSVD, stopped when the "
        "fit changes by less than 1e-4; ranks above what a window allows are clipped.",
        "The tensor step follows every tenth episode once all agents have finished it; ties between agents go to the "
        "lowest index; an action whose weight is 0 stays at 0.",
        "The path of a variant is that of its shortest episode while learning goes on.",
    ),
)
