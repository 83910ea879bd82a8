"""The paper's cart pole experiment (section IV.A, Figure 9) as data."""

from collections.abc import Callable

from tuckerl.adapters.resolve import Environment
from tuckerl.environments import cart_pole as simulators
from tuckerl.generalization.step import TensorStep
from tuckerl.learners.sarsa_lambda import SarsaLambda
from tuckerl.problems.simulator import Simulator
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
    base="sarsa-lambda",
    t_version="tsarsa-lambda",
    learner=SarsaLambda,
    parameters={
        "alpha": 1.0,
        "gamma": 0.95,
        "epsilon": 0.001,
        "epsilon_decay": 0.99,
        "lambda_": 0.95,
        "ties": "first",
    },
    step=TensorStep(every=10, ranks=(10, 10, 9, 1), weights="paper", share="min"),
    n_actions=21,
)


def problem(instance: int) -> Simulator:
    """Return the one cart pole there is."""
    return simulators.cart_pole()


def cart_pole(
    family: AlgorithmConfig = FAMILY, problem: Callable[[int], Environment] = problem, several: int = 3
) -> Scenario:
    """Return the experiment, or the same with another family, problem or number of several agents."""
    one, more, by_max = "tsarsa-lambda-1", f"tsarsa-lambda-{several}", f"tsarsa-lambda-{several}-max"
    controls = ("constant-1", f"constant-{several}-min", "permuted-1", f"permuted-{several}-min")
    names = dict.fromkeys(("sarsa-lambda", one, "tsarsa-lambda-2", more, by_max, *controls))
    return Scenario(
        name="cart-pole",
        title="Cart pole",
        number=0,
        problem=problem,
        n_instances=1,
        n_runs=120,
        n_episodes=300,
        variants=tuple(variant(family, name) for name in names),
        comparisons=(
            Comparison(
                "C1",
                "TSARSA(λ) with one agent balances longer than SARSA(λ)",
                "balance",
                "sarsa-lambda",
                one,
                controls[0],
            ),
            Comparison("C2", f"{several} TSARSA(λ) agents do better than one", "balance", one, more, controls[1]),
            Comparison(
                "C10",
                "the agent of least variance is the right one to copy, not of most",
                "balance",
                by_max,
                more,
                controls[1],
            ),
        ),
        record_paths_of=(),
        family=family,
        measure="balance",
        assumptions=(*SHARED_ASSUMPTIONS, *ASSUMPTIONS),
    )


ASSUMPTIONS = (
    Assumption(
        INVENTED, "The paper's 110 states are 108 cells of a grid and two absorbing ones, fallen and off the track."
    ),
    Assumption(
        OVERRULED,
        "Rewards are those of the public program behind the scenario: 10 - 10 (10 θ)² - 5 |x| - 10 θ', and at "
        "failure -10000 "
        "- 50 |x| - 100 |θ|. The paper: positive below 45 degrees, negative otherwise.",
    ),
    Assumption(OVERRULED, "The pole is uniform, as in that program; the paper speaks of a mass on a massless rod."),
    Assumption(
        OVERRULED,
        "Traces are replacing and zeroed at the start of an episode; Figure 8 prints accumulating and carried on.",
    ),
    Assumption(INVENTED, "A failing state is not bootstrapped from, where that program does so."),
    Assumption(
        INFERRED, '120 runs, from "averaging the results over 120 iterations"; 300 episodes of at most 1000 steps.'
    ),
    Assumption(
        INFERRED,
        'To copy the agent of least variance follows section III.B and Figure 8; IV.A says "the best performer".',
    ),
)

CART_POLE = cart_pole()
