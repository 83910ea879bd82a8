"""The paper's DYNA maze experiment (section IV.B, Figures 10 and 11): what is read, claimed and drawn of its file."""

from dataclasses import replace
from functools import partial

from tuckerl.studies import paper_problems
from tuckerl.studies.assumptions import inferred, invented, overruled
from tuckerl.studies.figure_text import CurveText, PathText, WeightText
from tuckerl.studies.paper import SHARED_ASSUMPTIONS, SHARES, TRUNCATED_HOSVD, several
from tuckerl.studies.planned import planned
from tuckerl.studies.study import Alternative

_PLANNED = planned("dyna-maze", n_actions=4, problem=paper_problems.maze)

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
    Alternative("Euclidean heuristic", problem=partial(paper_problems.maze_with, metric="euclidean")),
    Alternative("L1 heuristic", problem=partial(paper_problems.maze_with, metric="l1")),
    Alternative("planning restarts", {"search_control": "restart"}),
    Alternative("planning anywhere", {"search_control": "random"}),
    Alternative("50 planning steps", {"planning_steps": 50}),
    Alternative("first tie", {"ties": "first"}),
    TRUNCATED_HOSVD,
    Alternative("2 agents for several", comparisons=several(_PLANNED.comparisons, 2)),
    Alternative("5 agents for several", comparisons=several(_PLANNED.comparisons, 5)),
)

DYNA_MAZE = replace(
    _PLANNED,
    description="DYNA-H finds its way out of random mazes; the paper's section IV.B, Figures 10 and 11",
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
