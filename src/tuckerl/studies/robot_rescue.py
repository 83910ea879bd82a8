"""The paper's robot rescue experiment (section IV.C, Figure 13): what is read, claimed and drawn of its file."""

from dataclasses import replace
from functools import partial
from itertools import product

from tuckerl.studies import paper_problems
from tuckerl.studies.assumptions import inferred, invented
from tuckerl.studies.figure_text import CurveText, WeightText
from tuckerl.studies.paper import SHARED_ASSUMPTIONS, SHARES, TRUNCATED_HOSVD
from tuckerl.studies.planned import planned
from tuckerl.studies.study import Alternative, Comparison

_PLANNED = planned("robot-rescue", n_actions=25, problem=paper_problems.rescue)


def _of_teams(number: int) -> tuple[Comparison, ...]:
    """Return the claim, tested on several teams."""
    (one,) = _PLANNED.comparisons
    return (replace(one, candidate=f"team-tq-{number}", control=f"constant-{number}-max"),)


ASSUMPTIONS = (
    invented("The map is ours: the paper's 8 x 8 map was never published. The object fills one cell."),
    invented(
        "Each robot explores on its own with probability epsilon, else plays its part of the greedy joint action; a "
        "joint action that is not greedy zeroes the traces (Watkins)."
    ),
    inferred(
        "An agent is a team of two robots in its own copy of the world, one team by default: the robots' own tables "
        "would be "
        "identical."
    ),
    invented("Traces are replacing and zeroed at the start of an episode, as in the cart pole."),
    invented("Rewards are +1 for each grip and +10 for the delivery; an episode is cut off after 1000 steps."),
)

ALTERNATIVES = (
    Alternative("step cost 0.1", problem=partial(paper_problems.rescue, step_cost=0.1)),
    Alternative("step cost 1", problem=partial(paper_problems.rescue, step_cost=1.0)),
    Alternative("traces not cut", {"cut_traces": False}),
    Alternative("the team explores as one", {"exploration": "joint"}),
    Alternative("accumulating traces", {"trace": "accumulating"}),
    Alternative("traces carried over", {"carry_trace": True}),
    Alternative("first tie", {"ties": "first"}),
    TRUNCATED_HOSVD,
    Alternative("2 teams", comparisons=_of_teams(2)),
    Alternative("3 teams", comparisons=_of_teams(3)),
)

_MOVES = ("left", "right", "up", "down", "stay")

ROBOT_RESCUE = replace(
    _PLANNED,
    description="Team-Q brings an object home; the paper's section IV.C, Figure 13",
    assumptions=(*SHARED_ASSUMPTIONS, *ASSUMPTIONS),
    shares=SHARES,
    alternatives=ALTERNATIVES,
    figures=(
        CurveText(
            "fig13",
            "Figure 13. Cumulative cost of the rescue",
            total="cumulative cost (steps to deliver)",
            gain="steps saved against {base}",
            summed="steps until the object is home, averaged over a variant's teams and cumulated over episodes",
        ),
        WeightText(
            "omega-robot-rescue",
            "Action weights of the rescue over time",
            actions=tuple(", ".join(moves) for moves in product(_MOVES, repeat=2)),
            axis="joint action (robot A, robot B)",
        ),
    ),
    is_of_paper=True,
)
