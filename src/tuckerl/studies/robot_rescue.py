"""The paper's robot rescue experiment (section IV.C, Figure 13) as data."""

from functools import partial
from itertools import product
from typing import Any

from tuckerl.environments import robot_rescue as worlds
from tuckerl.generalization.tensor_step import TensorStep
from tuckerl.learners.team_q import TeamQ
from tuckerl.problems.mdp import TabularMDP
from tuckerl.studies.assumptions import inferred, invented
from tuckerl.studies.figure_text import CurveText, WeightText
from tuckerl.studies.paper import SHARED_ASSUMPTIONS, SHARES, TRUNCATED_HOSVD
from tuckerl.studies.study import AlgorithmConfig, Alternative, Comparison, Scenario, variants

ALGORITHM = AlgorithmConfig(
    base="team-q",
    t_version="team-tq",
    learner=TeamQ,
    parameters={"alpha": 0.1, "gamma": 0.95, "epsilon": 0.1, "lambda_": 0.95},
    step=TensorStep(every=10, ranks=(50, 10, 9, 1), weights="paper", share="max"),
    n_actions=25,
)


def problem(instance: int, **changes: Any) -> TabularMDP:
    """Return the one rescue world there is, or the same with other parameters."""
    return worlds.robot_rescue(**changes)


def comparisons(candidate: str, control: str) -> tuple[Comparison, ...]:
    """Return the claim, tested on a candidate of one team or of several."""
    return (Comparison("C7", "Team-TQ costs less than Team-Q", "cost", "team-q", candidate, control),)


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
    Alternative("step cost 0.1", problem=partial(problem, step_cost=0.1)),
    Alternative("step cost 1", problem=partial(problem, step_cost=1.0)),
    Alternative("traces not cut", {"cut_traces": False}),
    Alternative("the team explores as one", {"exploration": "joint"}),
    Alternative("accumulating traces", {"trace": "accumulating"}),
    Alternative("traces carried over", {"carry_trace": True}),
    Alternative("first tie", {"ties": "first"}),
    TRUNCATED_HOSVD,
    Alternative("2 teams", comparisons=comparisons("team-tq-2", "constant-2-max")),
    Alternative("3 teams", comparisons=comparisons("team-tq-3", "constant-3-max")),
)

_MOVES = ("left", "right", "up", "down", "stay")

ROBOT_RESCUE = Scenario(
    name="robot-rescue",
    title="Robot rescue",
    description="Team-Q brings an object home; the paper's section IV.C, Figure 13",
    number=2,
    problem=problem,
    n_instances=1,
    n_runs=50,
    n_episodes=100,
    algorithm=ALGORITHM,
    variants=variants(ALGORITHM, "team-q", "team-tq-1", "team-tq-3", "constant-1", "constant-3-max", "permuted-1"),
    measure="cost",
    comparisons=comparisons("team-tq-1", "constant-1"),
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
