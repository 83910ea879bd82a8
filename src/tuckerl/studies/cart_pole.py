"""The paper's cart pole experiment (section IV.A, Figure 9): what is read, claimed and drawn of its file."""

from dataclasses import replace
from functools import partial

from tuckerl.studies import paper_problems
from tuckerl.studies.assumptions import inferred, invented, overruled
from tuckerl.studies.figure_text import CurveText, WeightText
from tuckerl.studies.paper import SHARED_ASSUMPTIONS, SHARES, TRUNCATED_HOSVD, several
from tuckerl.studies.planned import planned
from tuckerl.studies.study import Alternative

_PLANNED = planned("cart-pole", n_actions=21, problem=paper_problems.pole)

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
        problem=partial(paper_problems.pole, absorbing=False),  # else there is nothing in a failure's row
    ),
    Alternative("random start", problem=partial(paper_problems.pole, start="uniform")),
    Alternative("reward +1 / -1", problem=partial(paper_problems.pole, reward="sign")),
    Alternative("random ties", {"ties": "random"}),
    TRUNCATED_HOSVD,
    Alternative("2 agents for several", comparisons=several(_PLANNED.comparisons, 2)),
    Alternative("5 agents for several", comparisons=several(_PLANNED.comparisons, 5)),
)

CART_POLE = replace(
    _PLANNED,
    description="SARSA(λ) balances a pole; the paper's section IV.A, Figure 9",
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
