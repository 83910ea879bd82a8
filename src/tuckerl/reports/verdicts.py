"""Two questions of every claim and their answers, as a table for a terminal."""

from collections.abc import Sequence

from tuckerl.reports.text import NOTHING, amount, amount_interval
from tuckerl.studies.claims import IS_BETTER_THAN_CONSTANT, IS_IT_THE_TENSOR, Claim

DOES_IT_HOLD = "does the claim hold?"
_MARK = "*"  # at the answers to the other second question
_WIDTHS = (len(DOES_IT_HOLD), len(IS_IT_THE_TENSOR))


def verdict_table(claims: Sequence[Claim]) -> str:
    """Return a table of the claims with both verdicts, and below it what those about copying are really asked."""
    rows = [(claim.id, claim.verdict, _tensor(claim), claim.claim) for claim in claims]
    lines = [_line("", DOES_IT_HOLD, IS_IT_THE_TENSOR, ""), *(_line(*row) for row in rows)]
    copying = [claim for claim in claims if claim.tensor_question == IS_BETTER_THAN_CONSTANT]
    if copying:
        lines.append(f"{_MARK} A claim about copying among agents. Asked instead: {IS_BETTER_THAN_CONSTANT}")
        lines += [f"{claim.id:>5}  {with_constant_weights(claim)}" for claim in copying]
    return "\n".join(lines)


def with_constant_weights(claim: Claim) -> str:
    """Return what the comparison of a claim about copying gives where every action has the same, constant weight."""
    number = amount(claim.constant)
    if number == NOTHING:
        return "The same comparison with constant weights was not run."
    return f"The same comparison with constant weights: {number} {amount_interval(claim.constant)}."


def _tensor(claim: Claim) -> str:
    mark = f" {_MARK}" if claim.tensor_question == IS_BETTER_THAN_CONSTANT else ""
    return f"{claim.tensor}{mark}" if claim.tensor else NOTHING


def _line(name: str, holds: str, tensor: str, claim: str) -> str:
    return f"{name:>3}  {holds:<{_WIDTHS[0]}}  {tensor:<{_WIDTHS[1]}}  {claim}".rstrip()
