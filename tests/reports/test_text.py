import math

import pytest

from tests.reports.examples import claim, study_of, weights_claim
from tuckerl.reports import text as wording
from tuckerl.reports.report import commands, outcome, reading
from tuckerl.reports.variant_text import described
from tuckerl.studies.cart_pole import CART_POLE
from tuckerl.studies.dyna_maze import DYNA_MAZE
from tuckerl.studies.scenarios import scenario_study
from tuckerl.studies.statistics import NO_DIFFERENCE, Difference
from tuckerl.studies.study import Study, variant

STUDY = study_of()


def read(verdict: str, low: float, high: float, claim_id: str = "C5") -> str:
    return reading(STUDY, claim(verdict, control=((low + high) / 2, low, high), claim_id=claim_id))


def test_a_gain_over_the_control_too_is_not_explained_by_the_learning_rate() -> None:
    assert read("holds", 0.01, 0.2) == "Better than the control: the smaller learning rate alone does not explain it."


def test_a_gain_that_the_control_has_as_well_is_explained_by_the_learning_rate() -> None:
    assert read("holds", -0.01, 0.2) == (
        "No better than the control: the smaller learning rate explains the gain, as far as these runs can tell."
    )


def test_a_gain_that_is_smaller_than_the_controls_is_explained_by_the_learning_rate() -> None:
    assert read("holds", -0.2, -0.1) == (
        "Worse than the control: the smaller learning rate explains the gain, and the tensor's weights lessen it."
    )


def test_the_control_of_several_agents_shares_as_they_do() -> None:
    assert "the smaller learning rate and the sharing explain the gain" in read("holds", -0.01, 0.2, "C6")
    assert "the smaller learning rate and the sharing alone do not explain it" in read("holds", 0.01, 0.2, "C6")


def test_a_claim_that_fails_is_said_to_fail() -> None:
    assert read("does not hold", -0.2, -0.1) == (
        "The opposite is the case: the whole interval lies below 0. Worse than the control."
    )
    assert read("not decided", -0.2, 0.1).startswith("The interval covers 0: these runs decide nothing.")


def test_rules_of_sharing_differ_in_neither_rate_nor_number_of_agents() -> None:
    gain = claim("holds", control=(0.0, -0.1, 0.1), claim_id="C10")
    made = gain._replace(scenario=CART_POLE.name, constant=Difference(0.2, 0.1, 0.3, 3, 0))
    assert reading(study_of(CART_POLE), made) == (
        "No better than the control: constant weights and the same sharing explain the gain, as far as these runs can "
        "tell. The same comparison with constant weights: +20.0 % [10.0, 30.0]."
    )


def test_pairs_that_all_diverged_and_a_control_that_was_not_run_are_said() -> None:
    lost = claim("not decided", (math.nan,) * 3, n_diverged=3)
    assert reading(STUDY, lost) == ("Nothing is left to compare: in all 3 pairs a run diverged.")
    unplayed = lost._replace(difference=NO_DIFFERENCE)
    assert reading(STUDY, unplayed) == "No pair was run."
    alone = claim("holds")._replace(control=NO_DIFFERENCE)
    assert reading(STUDY, alone) == "There is no run of the control to compare it with."


def test_one_pair_has_no_interval() -> None:
    one = claim("not decided", (0.1, math.nan, math.nan), (0.1, math.nan, math.nan))
    assert reading(STUDY, one) == ("Too few pairs for an interval. Too few pairs to compare it with the control.")
    assert wording.amount_interval(one.difference) == "no interval"


def test_a_claim_that_compares_nothing_has_no_reading() -> None:
    assert reading(STUDY, weights_claim()) == ""


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (wording.amount(Difference(-0.0516, -0.1, 0.0, 3, 0)), "\N{MINUS SIGN}5.2 %"),
        (wording.amount(Difference(-0.0004, -0.1, 0.0, 3, 0)), "+0.0 %"),
        (wording.amount_interval(Difference(0.1, -0.0003, 0.0, 3, 0)), "[\N{MINUS SIGN}0.030, 0.0]"),
        (wording.signed(-9.96), "\N{MINUS SIGN}10"),
        (wording.signed(9.94), "+9.9"),
        (wording.signed(-0.01), "0"),
        (wording.tick(-2.5), "\N{MINUS SIGN}2.5"),
        (wording.tick(0.0), "0"),
        (wording.amount(Difference(0.1, -0.1, 0.0, 3, 0)), "+10.0 %"),
        (wording.amount_interval(Difference(0.1, -0.1, 0.2, 3, 0)), "[\N{MINUS SIGN}10.0, 20.0]"),
        (wording.amount(NO_DIFFERENCE), wording.NOTHING),
        (wording.amount_interval(NO_DIFFERENCE), ""),
        (wording.whole(194090.36), "194,090"),
        (wording.whole(math.nan), wording.NOTHING),
        (wording.mean_of(106.444, "steps"), "106.4"),
        (wording.measured_interval(-5.4, 1000.0, "steps"), "[\N{MINUS SIGN}5, 1,000]"),
        (wording.measured_interval(math.nan, math.nan, "steps"), ""),
        (wording.plus_minus(123456.7, 12345.6), "123,457 ± 12,346"),
        (wording.plus_minus(0.5, 0.031), "0.5000 ± 0.031"),
        (wording.plus_minus(0.5, math.nan), "0.5000"),
        (wording.seconds(0.0095637), "9.56 ms"),
        (wording.seconds(12.345), "12.3 s"),
        (wording.seconds(math.nan), wording.NOTHING),
        (wording.total(1234.5, "steps"), "1,234"),
        (wording.total(-1.5, "return"), "\N{MINUS SIGN}1.50"),
        (wording.measured_interval(-1.5, 2.0, "return"), "[\N{MINUS SIGN}1.50, 2.00]"),
        (wording.mean_of(12.34, "steps"), "12.3"),
        (wording.mean_of(12.34, "return"), "12.34"),
        (wording.counted(1, "run"), "1 run"),
        (wording.ranks_of(None), "no ranks"),
        (wording.ranks_of((15, 3, 9, 1)), "ranks (15, 3, 9, 1)"),
        (wording.ranks_of("auto"), "ranks for 95 % of the energy"),
        (wording.ranks_of(0.999), "ranks for 99.9 % of the energy"),
        (wording.counted(1500, "run"), "1,500 runs"),
    ],
)
def test_numbers_are_written_for_people(text: str, expected: str) -> None:
    assert text == expected


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("dyna-h", "without the tensor step"),
        ("dyna-ht-1", "tensor step as printed"),
        ("dyna-ht-3", "tensor step as printed; share: max"),
        ("constant-3-max", "control: constant weights; share: max"),
        ("permuted-3", "control: permuted weights; no sharing"),
        ("relative-1", "weights: relative"),
    ],
)
def test_variants_are_described(name: str, expected: str) -> None:
    assert described(variant(DYNA_MAZE.algorithm, name)) == expected


def test_the_outcome_counts_verdicts_and_wins_over_the_control() -> None:
    claims = [
        claim("holds", control=(0.1, 0.05, 0.2)),
        claim("holds"),
        claim("does not hold"),
        claim("not decided"),
        weights_claim(),
    ]
    text = outcome([one._replace(tensor_question="is it the tensor?") for one in claims])
    assert text.startswith("Of 5 claims, 3 hold, 1 does not hold, 1 is not decided. Against the constant control, ")
    assert text.endswith("of 4 comparisons 1 shows a gain, 3 decide nothing.")
    assert outcome([]) == "No claim was tested."
    assert outcome([weights_claim()]) == "Of 1 claim, 1 holds."


@pytest.mark.parametrize("name", ["dyna-maze", "cart-pole", "all"])
@pytest.mark.parametrize(
    "numbers", [{}, {"runs": 7}, {"episodes": 30, "seed": 4}, {"runs": 7, "episodes": 30}, {"quick": True}]
)
def test_the_command_makes_the_same_study(name: str, numbers: dict[str, int]) -> None:
    study = scenario_study(name, **numbers)  # type: ignore[arg-type]  # quick is a flag
    (line,) = commands(study)
    words = line.split()
    assert words[:3] == ["tuckerl", "reproduce", name]
    given = {option: int(words[words.index(f"--{option}") + 1]) for option in numbers if option != "quick"}
    assert given == {option: number for option, number in numbers.items() if option != "quick"}
    assert ("--quick" in words) == ("quick" in numbers)
    assert commands(study, with_cells=True) == [f"{line} --sensitivity"]


def test_a_study_that_no_one_command_makes_is_repeated_by_scenario() -> None:
    study = scenario_study(runs=7)
    first, *others = study.scenarios
    mixed = commands(Study((first.resized(n_runs=4), *others), 3))
    assert [line.split()[2] for line in mixed] == ["cart-pole", "dyna-maze", "robot-rescue"]
    assert mixed[0] == "tuckerl reproduce cart-pole --runs 4 --episodes 300 --seed 3"
