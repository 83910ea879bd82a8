from tests.reports.examples import claim, weights_claim
from tuckerl.reports.verdicts import verdict_table
from tuckerl.studies.claims import IS_BETTER_THAN_CONSTANT, IS_IT_THE_TENSOR
from tuckerl.studies.statistics import Difference


def test_a_terminal_shows_both_verdicts() -> None:
    held = claim("holds", control=(-0.1, -0.2, -0.05), claim_id="C1")._replace(tensor_question=IS_IT_THE_TENSOR)
    copying = claim("holds", claim_id="C10")._replace(
        tensor_question=IS_BETTER_THAN_CONSTANT, constant=Difference(0.2, 0.1, 0.3, 3, 0)
    )
    assert verdict_table([held, weights_claim(), copying]).splitlines() == [
        "     does the claim hold?  is it the tensor?",
        " C1  holds                 no                 the claim number C1",
        " C9  holds                 \N{EN DASH}                  omega is in (0, 1]",
        "C10  holds                 not decided *      the claim number C10",
        "* A claim about copying among agents. Asked instead: are the weights better than a constant rate?",
        "  C10  The same comparison with constant weights: +20.0 % [10.0, 30.0].",
    ]


def test_constant_variants_that_were_not_run_are_said() -> None:
    alone = claim("holds", claim_id="C2")._replace(tensor_question=IS_BETTER_THAN_CONSTANT)
    assert verdict_table([alone]).splitlines()[-1] == "   C2  The same comparison with constant weights was not run."


def test_without_claims_about_copying_there_is_no_other_question() -> None:
    assert len(verdict_table([claim()._replace(tensor_question=IS_IT_THE_TENSOR)]).splitlines()) == 2
