"""The paper's DYNA maze experiment (section IV.B, Figures 10 and 11) as data."""

from functools import partial

from tuckerl.generalization.tensor_step import TensorStep
from tuckerl.learners.dyna_h import DynaH
from tuckerl.problems.maze import Maze, random_maze
from tuckerl.problems.mdp import TabularMDP
from tuckerl.studies.assumptions import inferred, invented, overruled
from tuckerl.studies.figure_text import CurveText, PathText, WeightText
from tuckerl.studies.paper import SHARED_ASSUMPTIONS, SHARES, TRUNCATED_HOSVD
from tuckerl.studies.study import AlgorithmConfig, Alternative, Comparison, Scenario, variants

ALGORITHM = AlgorithmConfig(
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


def problem_with(instance: int, metric: str) -> TabularMDP:
    """Return the same maze with another heuristic."""
    maze = problem(instance)
    mdp = maze.to_mdp()
    return TabularMDP.from_arrays(mdp.arrays, mdp.n_states, maze.heuristic(metric))  # type: ignore[arg-type]  # a name


def comparisons(several: int = 3) -> tuple[Comparison, ...]:
    """Return the claims, `several` being the number of several agents."""
    one, more = "dyna-ht-1", f"dyna-ht-{several}"
    copying = (one, more, f"constant-{several}-max", "constant-1")
    return (
        Comparison("C3", "DYNA-HT finds a shorter path than DYNA-H", "path", "dyna-h", one, "constant-1"),
        Comparison("C4", f"{several} DYNA-HT agents find a shorter path than one", "path", *copying),
        Comparison("C5", "DYNA-HT with one agent costs less than DYNA-H", "cost", "dyna-h", one, "constant-1"),
        Comparison("C6", f"{several} DYNA-HT agents cost less than one", "cost", *copying),
    )


ASSUMPTIONS = (
    inferred("The start is the cell (0, 3): its distance of 59 to the goal is the length of the three-agent path."),
    inferred(
        "A cell is a wall when a draw from N(0, 0.3), rounded, is not 0: 9.6 % of the cells. A maze without a path "
        "is drawn again. The ten mazes are those of the numbers 0 to 9, whatever the seed."
    ),
    invented("The model remembers whether an outcome ended the episode."),
    overruled(
        "Planning walks on from where the last planned step led; Figures 6 and 7 print no such walk. One of three "
        "public implementations does so."
    ),
    inferred(
        "The path of a variant is that of its shortest episode while learning goes on, in the picture the best agent's."
    ),
)

ALTERNATIVES = (
    Alternative("Euclidean heuristic", problem=partial(problem_with, metric="euclidean")),
    Alternative("L1 heuristic", problem=partial(problem_with, metric="l1")),
    Alternative("planning restarts", {"search_control": "restart"}),
    Alternative("planning anywhere", {"search_control": "random"}),
    Alternative("50 planning steps", {"planning_steps": 50}),
    Alternative("first tie", {"ties": "first"}),
    TRUNCATED_HOSVD,
    Alternative("2 agents for several", comparisons=comparisons(2)),
    Alternative("5 agents for several", comparisons=comparisons(5)),
)

DYNA_MAZE = Scenario(
    name="dyna-maze",
    title="DYNA maze",
    description="DYNA-H finds its way out of random mazes; the paper's section IV.B, Figures 10 and 11",
    number=1,
    problem=problem,
    n_instances=10,
    n_runs=25,
    n_episodes=100,
    algorithm=ALGORITHM,
    variants=variants(
        ALGORITHM,
        *("dyna-h", "dyna-ht-1", "dyna-ht-3"),
        *("constant-1", "constant-3-max", "permuted-1", "permuted-3-max"),
    ),
    measure="cost",
    comparisons=comparisons(),
    assumptions=(*SHARED_ASSUMPTIONS, *ASSUMPTIONS),
    record_paths_of=("dyna-h", "dyna-ht-1", "dyna-ht-3"),
    shares=SHARES,
    alternatives=ALTERNATIVES,
    n_alternative_runs=8,
    figures=(
        PathText(
            "fig10", "Figure 10. Paths found in one maze", paper_steps={"dyna-h": 90, "dyna-ht-1": 83, "dyna-ht-3": 59}
        ),
        CurveText(
            "fig11",
            "Figure 11. Cumulative cost of finding the way out",
            total="cumulative cost (steps in {instances})",
            gain="steps saved against {base}",
            summed="steps, averaged over a variant's agents, summed over {instances} and cumulated over episodes",
        ),
        WeightText("omega-dyna-maze", "Action weights over time", actions=("up", "down", "left", "right")),
    ),
    instance="maze",
    is_of_paper=True,
)
