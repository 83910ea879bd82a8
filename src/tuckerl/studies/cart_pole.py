"""The paper's cart pole experiment (section IV.A, Figure 9) as data."""

from functools import partial
from typing import Any

from tuckerl.environments import cart_pole as simulators
from tuckerl.generalization.tensor_step import TensorStep
from tuckerl.learners.sarsa_lambda import SarsaLambda
from tuckerl.problems.simulator import Simulator
from tuckerl.studies.assumptions import inferred, invented, overruled
from tuckerl.studies.figure_text import CurveText, WeightText
from tuckerl.studies.paper import SHARED_ASSUMPTIONS, SHARES, TRUNCATED_HOSVD
from tuckerl.studies.study import AlgorithmConfig, Alternative, Comparison, Scenario, variants

ALGORITHM = AlgorithmConfig(
    base="sarsa-lambda",
    t_version="tsarsa-lambda",
    learner=SarsaLambda,
    parameters={"alpha": 1.0, "gamma": 0.95, "epsilon": 0.001, "epsilon_decay": 0.99, "lambda_": 0.95, "ties": "first"},
    step=TensorStep(every=10, ranks=(10, 10, 9, 1), weights="paper", share="min"),
    n_actions=21,
)


def problem(instance: int, **changes: Any) -> Simulator:
    """Return the one cart pole there is, or the same with other parameters."""
    return simulators.cart_pole(**changes)


def comparisons(several: int = 3) -> tuple[Comparison, ...]:
    """Return the claims, `several` being the number of several agents."""
    one, more = "tsarsa-lambda-1", f"tsarsa-lambda-{several}"
    control = f"constant-{several}-min"
    return (
        Comparison(
            "C1", "TSARSA(λ) with one agent balances longer than SARSA(λ)", "balance", "sarsa-lambda", one, "constant-1"
        ),
        Comparison("C2", f"{several} TSARSA(λ) agents do better than one", "balance", one, more, control, "constant-1"),
        Comparison(
            "C10",
            "the agent of least variance is the right one to copy, not of most",
            "balance",
            f"{more}-max",
            more,
            control,
            f"constant-{several}-max",
        ),
    )


ASSUMPTIONS = (
    invented("The paper's 110 states are 108 cells of a grid and two absorbing ones, fallen and off the track."),
    overruled(
        "Rewards are those of the public program behind the scenario: 10 - 10 (10 θ)² - 5 |x| - 10 θ', and at "
        "failure -10000 - 50 |x| - 100 |θ|. The paper: positive below 45 degrees, negative otherwise."
    ),
    overruled("The pole is uniform, as in that program; the paper speaks of a mass on a massless rod."),
    overruled(
        "Traces are replacing and zeroed at the start of an episode; Figure 8 prints accumulating and carried on."
    ),
    invented("A failing state is not bootstrapped from, where that program does so."),
    inferred('120 runs, from "averaging the results over 120 iterations"; 300 episodes of at most 1000 steps.'),
    inferred('To copy the agent of least variance follows section III.B and Figure 8; IV.A says "the best performer".'),
)

ALTERNATIVES = (
    Alternative("accumulating traces", {"trace": "accumulating"}),
    Alternative("traces carried over", {"carry_trace": True}),
    Alternative(
        "bootstrap at failure",
        {"bootstrap_terminal": True},
        problem=partial(problem, absorbing=False),  # else there is nothing in a failure's row
    ),
    Alternative("random start", problem=partial(problem, start="uniform")),
    Alternative("reward +1 / -1", problem=partial(problem, reward="sign")),
    Alternative("random ties", {"ties": "random"}),
    TRUNCATED_HOSVD,
    Alternative("2 agents for several", comparisons=comparisons(2)),
    Alternative("5 agents for several", comparisons=comparisons(5)),
)

CART_POLE = Scenario(
    name="cart-pole",
    title="Cart pole",
    description="SARSA(λ) balances a pole; the paper's section IV.A, Figure 9",
    number=0,
    problem=problem,
    n_instances=1,
    n_runs=120,
    n_episodes=300,
    algorithm=ALGORITHM,
    variants=variants(
        ALGORITHM,
        "sarsa-lambda",
        *("tsarsa-lambda-1", "tsarsa-lambda-2", "tsarsa-lambda-3", "tsarsa-lambda-3-max"),
        *("constant-1", "constant-3-min", "constant-3-max", "permuted-1", "permuted-3-min"),
    ),
    measure="balance",
    comparisons=comparisons(),
    assumptions=(*SHARED_ASSUMPTIONS, *ASSUMPTIONS),
    shares=SHARES,
    alternatives=ALTERNATIVES,
    figures=(
        CurveText(
            "fig9",
            "Figure 9. Cumulative number of balanced steps",
            total="cumulative number of balanced steps",
            gain="balanced steps more than {base}",
            summed="balanced steps, averaged over a variant's agents and cumulated over episodes (more is better)",
        ),
        WeightText(
            "omega-cart-pole",
            "Action weights of the cart pole over time",
            actions=tuple(f"{(action - 10) / 10:g}".replace("-", "\N{MINUS SIGN}") for action in range(21)),
            axis="action (part of the full force)",
        ),
    ),
    is_of_paper=True,
)
