"""What the paper's three scenarios have in common: readings of the paper, and what the ablations compare."""

from dataclasses import replace

from tuckerl.studies.assumptions import inferred, invented
from tuckerl.studies.study import Alternative, Comparison

SHARED_ASSUMPTIONS = (
    inferred("One pass of the paper's inner loop is one whole episode of one agent."),
    inferred(
        "The tables are factorised after every tenth episode, once all agents have finished it (Figure 7 prints it "
        "inside the loop over agents: taken as a misprint)."
    ),
    invented(
        "The decomposition is Tucker3 by alternating least squares, stopped when the fit changes by less than 1e-4, "
        "started from the truncated HOSVD where the paper's toolbox starts at random."
    ),
    invented(
        "Ranks above what a window allows are clipped; a window of zeros changes nothing; a run whose values are no "
        "longer finite is marked diverged in that episode and left out of comparisons."
    ),
    invented("Ties between agents go to the lowest index; an action whose weight is 0 stays at 0."),
    invented("Tables begin at zero. Nothing is bootstrapped from a terminal state, and all from a truncated one."),
)

SHARES = ("max", "min", "best", "random", "mean", "consensus")
"""The sharing rules that the ablations compare: a rule that is registered later adds nothing to them."""

TRUNCATED_HOSVD = Alternative("truncated HOSVD", step={"max_iterations": 0})


def several(comparisons: tuple[Comparison, ...], number: int) -> tuple[Comparison, ...]:
    """Return claims about 3 agents, which are "several" in the paper's files, for another number of agents."""

    def named(variant: str) -> str:
        return variant.replace("-3", f"-{number}")

    return tuple(
        replace(
            one,
            claim=one.claim.replace("3 ", f"{number} ", 1) if one.claim.startswith("3 ") else one.claim,
            base=named(one.base),
            candidate=named(one.candidate),
            control=named(one.control),
            control_base=named(one.control_base),
        )
        for one in comparisons
    )
