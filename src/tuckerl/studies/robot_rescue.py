"""The paper's robot rescue experiment (section IV.C, Figure 13) as data."""

from collections.abc import Callable

from tuckerl.adapters.resolve import Environment
from tuckerl.environments import robot_rescue as worlds
from tuckerl.generalization.step import TensorStep
from tuckerl.learners.team_q import TeamQ
from tuckerl.problems.mdp import TabularMDP
from tuckerl.studies.study import (
    INFERRED,
    INVENTED,
    SHARED_ASSUMPTIONS,
    AlgorithmConfig,
    Assumption,
    Comparison,
    Scenario,
    variant,
)

FAMILY = AlgorithmConfig(
    base="team-q",
    t_version="team-tq",
    learner=TeamQ,
    parameters={"alpha": 0.1, "gamma": 0.95, "epsilon": 0.1, "lambda_": 0.95},
    step=TensorStep(every=10, ranks=(50, 10, 9, 1), weights="paper", share="max"),
    n_actions=25,
)


def problem(instance: int) -> TabularMDP:
    """Return the one rescue world there is."""
    return worlds.robot_rescue()


def robot_rescue(
    family: AlgorithmConfig = FAMILY, problem: Callable[[int], Environment] = problem, several: int | None = None
) -> Scenario:
    """Return the experiment, or the same with another family or problem, or with several teams where it has one."""
    more = several or 3
    names = ("team-q", "team-tq-1", f"team-tq-{more}", "constant-1", f"constant-{more}-max", "permuted-1")
    candidate, control = (names[2], names[4]) if several else (names[1], names[3])
    return Scenario(
        name="robot-rescue",
        title="Robot rescue",
        number=2,
        problem=problem,
        n_instances=1,
        n_runs=50,
        n_episodes=100,
        variants=tuple(variant(family, name) for name in names),
        comparisons=(Comparison("C7", "Team-TQ costs less than Team-Q", "cost", "team-q", candidate, control),),
        record_paths_of=(),
        family=family,
        measure="cost",
        assumptions=(*SHARED_ASSUMPTIONS, *ASSUMPTIONS),
    )


ASSUMPTIONS = (
    Assumption(INVENTED, "The map is ours: the paper's 8 x 8 map was never published. The object fills one cell."),
    Assumption(
        INVENTED,
        "Each robot explores on its own with probability epsilon, else plays its part of the greedy joint action; a "
        "joint "
        "action that is not greedy zeroes the traces (Watkins).",
    ),
    Assumption(
        INFERRED,
        "An agent is a team of two robots in its own copy of the world, one team by default: the robots' own tables "
        "would be "
        "identical.",
    ),
    Assumption(INVENTED, "Traces are replacing and zeroed at the start of an episode, as in the cart pole."),
    Assumption(
        INVENTED, "Rewards are +1 for each grip and +10 for the delivery; an episode is cut off after 1000 steps."
    ),
)

ROBOT_RESCUE = robot_rescue()
