import hashlib
import pickle
import re
from pathlib import Path

import pytest

import tuckerl
from tests.studies.study_texts import LAKE, changed
from tuckerl.errors import ParameterError, UnknownNameError
from tuckerl.generalization.tensor_step import TensorStep
from tuckerl.studies.study import Study
from tuckerl.studies.study_file import parse_study_file, read_study_file, seed_number
from tuckerl.studies.study_making import study_of


def made(text: str) -> Study:
    return study_of(parse_study_file(text))


def test_problems_variants_and_comparisons_are_those_of_the_file() -> None:
    (scenario,) = made(LAKE).scenarios
    assert (scenario.name, scenario.n_runs, scenario.n_episodes, scenario.measure) == ("lake", 3, 20, "return")
    assert scenario.environment["id"] == "FrozenLake-v1"
    assert scenario.environment["keywords"] == {"is_slippery": False}
    names = ["base", "t[alpha=0.1]", "t[alpha=0.2]", "t[alpha=0.1]-constant"]
    assert [variant.name for variant in scenario.variants] == names
    base, first, second, control = scenario.variants
    assert (base.learner, base.parameters, base.tensor_step) == (tuckerl.SarsaLambda, {"alpha": 0.1}, None)
    assert (first.parameters, second.parameters) == ({"alpha": 0.1}, {"alpha": 0.2})
    assert first.tensor_step == second.tensor_step == TensorStep(10, (15, 3, 9, 1), "paper", "min")
    assert control.tensor_step == TensorStep(10, (15, 3, 9, 1), "constant", "none")
    (compared,) = scenario.comparisons
    assert (compared.base, compared.candidate, compared.control) == (names[0], names[1], names[3])
    assert compared.measure == "return"


def test_numbers_are_those_of_the_problem_or_else_of_the_file_or_else_the_defaults() -> None:
    other = '[[problem]]\nenv = "CliffWalking-v1"\nruns = 7\nepisodes = 8\n\n[[algorithm]]'
    lake, cliff = made("seed = 5\n" + changed(("[[algorithm]]", other))).scenarios
    assert (lake.n_runs, lake.n_episodes) == (3, 20)
    assert (cliff.name, cliff.n_runs, cliff.n_episodes) == ("CliffWalking-v1", 7, 8)
    (plain,) = made(changed(("runs = 3\nepisodes = 20", ""))).scenarios
    assert (plain.n_runs, plain.n_episodes) == (50, 500)
    assert made("seed = 5\n" + LAKE).seed == 5


def test_seeds_come_from_the_name_of_a_problem_and_not_from_its_place() -> None:
    other = '[[problem]]\nenv = "CliffWalking-v1"\n\n'
    (alone,) = made(LAKE).scenarios
    _, second = made(changed(("[[problem]]", f"{other}[[problem]]"))).scenarios
    assert second.specification() == alone.specification()
    assert second.number == alone.number == seed_number("lake")
    assert seed_number("lake") == 2**63 + int(hashlib.sha256(b"lake").hexdigest()[:16], 16) // 2
    assert seed_number("lake") != seed_number("laka")
    (renamed,) = made(changed(('"lake"', '"pond"'))).scenarios
    assert renamed.number == seed_number("pond")
    assert made(LAKE).run_seed(alone, 0, 1).spawn_key == (seed_number("lake"), 0, 1)
    assert all(2**32 <= seed_number(str(n)) < 2**64 for n in range(100))


def test_what_a_problem_sets_goes_to_the_algorithms_that_take_it() -> None:
    text = changed(
        ("keywords = { is_slippery = false }", "settings = { lambda_ = 0.5, gamma = 0.9 }"),
        ('"sarsa-lambda"', '"q-learning"'),
    )
    base, first, *_ = made(text).scenarios[0].variants
    assert base.parameters == {"alpha": 0.1, "gamma": 0.9}
    assert first.parameters == {"alpha": 0.1, "gamma": 0.9, "lambda_": 0.5}


@pytest.mark.parametrize(
    ("written", "values"),
    [
        ("[1, 2.5]", ["1", "2.5"]),
        ("{ from = 0.5, to = 0.9, steps = 5 }", ["0.5", "0.6", "0.7", "0.8", "0.9"]),
        ('{ from = 0.001, to = 0.1, steps = 3, scale = "log" }', ["0.001", "0.01", "0.1"]),
        ("{ from = 1, to = 9, steps = 3 }", ["1", "5", "9"]),
        ("{ from = 0.1, to = 0.9, steps = 9 }", [f"0.{n}" for n in range(1, 10)]),
        ("{ from = 1.0, to = 9, steps = 3 }", ["1.0", "5.0", "9.0"]),
        ("{ from = 1, to = 2, steps = 3 }", ["1.0", "1.5", "2.0"]),
        ('["Linear(1, 0, 9)", 0.1]', ["Linear(1, 0, 9)", "0.1"]),
    ],
)
def test_a_grid_has_the_values_that_it_names(written: str, values: list[str]) -> None:
    parameter = "epsilon" if "Linear" in written else "initial_q"
    text = LAKE[: LAKE.index("grid")] + f"grid = {{ {parameter} = {written} }}\n"
    variants = made(text).scenarios[0].variants[1:]
    assert [variant.name for variant in variants] == [f"t[{parameter}={value}]" for value in values]
    if parameter == "epsilon":
        assert variants[0].parameters == {"epsilon": tuckerl.Linear(1, 0, 9)}
    else:
        assert [variant.parameters[parameter] for variant in variants] == [float(value) for value in values]


def test_ranks_are_numbers_or_a_share_of_the_energy() -> None:
    study = made(changed(("grid = { ", 'grid = { ranks = [[3, 2, 2, 1], "auto", 0.9], '), ("t[alpha=0.1]", "t")))
    variants = [one for one in study.scenarios[0].variants if one.name.startswith("t[") and "alpha=0.1" in one.name]
    names = [f"t[ranks={ranks},alpha=0.1]" for ranks in ("[3,2,2,1]", "auto", "0.9")]
    assert [one.name for one in variants] == [*names, *(f"{name}-constant" for name in names)]
    found = [one.specification()["tensor_step"]["ranks"] for one in variants[:3]]
    assert found == [[3, 2, 2, 1], "auto", 0.9]
    with pytest.raises(ParameterError, match=r"line 17: .*ranks, as a share .* must be a number in \(0, 1\]; got 1.5"):
        made(changed(("grid = { ", "grid = { ranks = [0.9, 1.5], "), ("t[alpha=0.1]", "t")))


def test_a_grid_of_several_settings_has_every_combination_and_agents_are_one() -> None:
    grid = ("grid = { ", "grid = { agents = [1, 3], every = [5], ")
    variants = made(changed(grid, ("t[alpha=0.1]", "t"))).scenarios[0].variants
    found = [(one.n_agents, one.tensor_step.every, one.parameters["alpha"]) for one in variants if one.tensor_step]
    assert found[:4] == [(1, 5, 0.1), (1, 5, 0.2), (3, 5, 0.1), (3, 5, 0.2)]
    assert variants[4].name == "t[agents=3,every=5,alpha=0.2]"


def test_a_grid_as_candidate_is_each_of_its_variants() -> None:
    scenario = made(changed(("t[alpha=0.1]", "t"))).scenarios[0]
    assert [one.candidate for one in scenario.comparisons] == ["t[alpha=0.1]", "t[alpha=0.2]"]
    assert [one.control for one in scenario.comparisons] == ["t[alpha=0.1]-constant", "t[alpha=0.2]-constant"]
    assert len(scenario.variants) == 5


def test_a_control_that_is_there_is_not_played_twice() -> None:
    own = '[[algorithm]]\nname = "mine"\nalgorithm = "tsarsa-lambda"\n'
    own += 'settings = { alpha = 0.1, weights = "constant", share = "none" }\n'
    scenario = made(changed(("[[compare]]", f"{own}[[compare]]"))).scenarios[0]
    assert [one.control for one in scenario.comparisons] == ["mine"]
    assert [one.name for one in scenario.variants] == ["base", "t[alpha=0.1]", "t[alpha=0.2]", "mine"]
    plain = made(changed(("t[alpha=0.1]", "mine"), ("[[compare]]", f"{own}[[compare]]"))).scenarios[0]
    assert [one.control for one in plain.comparisons] == [""]


def test_comparisons_are_of_the_problems_and_by_the_measure_that_they_name() -> None:
    pond = '[[problem]]\nname = "pond"\nenv = "FrozenLake-v1"\n\n[[algorithm]]'
    asked = ("\ncandidate =", '\nproblems = ["pond"]\nmeasure = "final"\ncandidate =')
    lake, other = made(changed(("[[algorithm]]", pond), asked)).scenarios
    assert lake.comparisons == ()
    assert [one.measure for one in other.comparisons] == ["final"]
    assert [one.name for one in lake.variants] == ["base", "t[alpha=0.1]", "t[alpha=0.2]"]


def test_a_study_can_be_sent_to_another_process() -> None:
    study = made(LAKE)
    there = pickle.loads(pickle.dumps(study))  # noqa: S301  # as multiprocessing does
    assert there.specification() == study.specification()


WRONG: list[tuple[str, str, int, str]] = [
    ("runs = 3", "runs = ", 1, "it is no TOML: Invalid value"),
    ("runs = 3", "rns = 3", 1, "unknown key 'rns': did you mean 'runs'?"),
    ("runs = 3", "runs = 2.5", 1, "runs must be a whole number of at least 1; got 2.5 of type float"),
    ("runs = 3", "runs = true", 1, "runs must be a whole number of at least 1; got True of type bool"),
    ("episodes = 20", "episodes = 0", 2, "episodes must be a whole number of at least 1; got 0"),
    ("runs = 3", "seed = -1", 1, "seed must be a whole number of at least 0; got -1"),
    ("episodes = 20", 'measure = "speed"', 2, "unknown measure 'speed': use one of balance, cost, final, path, return"),
    ("[[problem]]", "[problem]", 4, r"problem must be one or more tables: head each with \[\[problem\]\]"),
    ("[[algorithm]]", "[[algoritm]]", 9, "unknown key 'algoritm': did you mean 'algorithm'?"),
    ('env = "FrozenLake-v1"', "", 4, "env is missing here"),
    ('"FrozenLake-v1"', '"FrozenLakes-v1"', 6, "unknown environment 'FrozenLakes-v1': did you mean 'FrozenLake-v1'?"),
    ('"FrozenLake-v1"', "3", 6, "env must be text; got 3"),
    ("is_slippery", "slippy", 6, "cannot make FrozenLake-v1 with slippy=False"),
    ("false", "1979-05-27", 7, "is_slippery must be a number, text, true, false or a list of these; got 1979-05-27"),
    ("{ is_slippery = false }", "3", 7, r"keywords must be a table, such as \{ key = 1 \}; got 3"),
    ("keywords = { is_slippery = false }", "settings = { alhpa = 3 }", 7, "no parameter 'alhpa': did you mean 'alpha'"),
    (
        "keywords = { is_slippery = false }",
        "settings = { alpha = 1 }",
        12,
        "alpha is also set by the problem 'lake', on line 7",
    ),
    ("keywords = { is_slippery = false }", "settings = { gamma = 2 }", 7, r"gamma must be a number in \[0, 1\]; got 2"),
    ('"sarsa-lambda"', '"sarsa-lamda"', 11, "unknown algorithm 'sarsa-lamda': did you mean 'sarsa-lambda'?"),
    ('"sarsa-lambda"\nsettings = { alpha = 0.1 }', '"team-q"', 9, "team-q plays the joint actions of several agents"),
    ("alpha = 0.1 }", "alpha = 2 }", 12, r"alpha must be a number in \(0, 1\]; got 2"),
    ("alpha = 0.1 }", 'alpha = "a" }', 12, r"alpha must be a number in \(0, 1\]; got 'a' of type str"),
    ("alpha = 0.1 }", "alpha = nan }", 12, "alpha must be a finite number; got nan"),
    ("alpha = 0.1 }", "every = 5 }", 12, "every belongs to the tensor step, which sarsa-lambda is without"),
    ("alpha = 0.1 }", "n_agents = 5 }", 12, "n_agents is no setting: write agents = 3"),
    (
        "alpha = 0.1 }",
        'epsilon = "Lineal(1, 0, 3)" }',
        12,
        "epsilon: unknown schedule 'Lineal': did you mean 'Linear'?",
    ),
    ("alpha = 0.1 }", 'epsilon = "Linear(1, 0)" }', 12, r"epsilon must be given Linear\(start, stop, episodes\)"),
    ("alpha = [0.1,\n                  0.2]", "alpha = []", 17, "alpha has no value"),
    ("alpha = [0.1,\n                  0.2]", "", 17, "grid is empty"),
    ("alpha = [0.1,", "alpha = [0.2,", 18, "alpha has the value 0.2 twice"),
    ("0.2] }", "2] }", 18, r"t\[alpha=2\] on lake: alpha must be a number in \(0, 1\]; got 2"),
    ("[0.1,\n                  0.2]", "3", 17, "alpha of a grid must be a list of values"),
    ("[0.1,\n                  0.2]", "{ from = 1, to = 2 }", 17, "steps is missing: a range is"),
    (
        "[0.1,\n                  0.2]",
        "{ from = 1, to = 2, steps = 1 }",
        17,
        "steps must be a whole number of at least 2",
    ),
    ("[0.1,\n                  0.2]", "{ from = 2, to = 1, steps = 2 }", 17, "from must be below to; got 2 and 1"),
    (
        "[0.1,\n                  0.2]",
        '{ from = 0, to = 1, steps = 2, scale = "log" }',
        17,
        "from must be above 0 where the scale is log",
    ),
    ("grid = {", "settings = { alpha = 1 }\ngrid = {", 18, "alpha is set and varied by the grid"),
    ('name = "t"', 'name = "base"', 15, "there are two algorithms called 'base', the first on line 9"),
    (
        'name = "base"\nalgorithm = "sarsa-lambda"',
        'algorithm = "sarsa"\n[[algorithm]]\nalgorithm = "sarsa"',
        11,
        "two algo",
    ),
    ('name = "t"', 'name = " t"', 15, "name must be 1 to 100 printable characters"),
    ('name = "base"', 'name = "t[alpha=0.1]"', 14, r"there are two variants called t\[alpha=0.1\]"),
    ('base = "base"', 'base = "bse"', 21, "unknown variant 'bse': did you mean 'base'?"),
    ('base = "base"', 'base = "t"', 21, r"t has 2 variants: name one of them, such as 't\[alpha=0.1\]'"),
    ('base = "base"', "", 20, "base is missing here"),
    ('candidate = "t[alpha=0.1]"', 'candidate = "t[alpha=0.3]"', 22, r"did you mean 't\[alpha=0.2\]'"),
    ('candidate = "t[alpha=0.1]"', 'candidate = "base"', 22, "base and candidate are both base and would do the same"),
    ('candidate = "t[alpha=0.1]"', 'candidate = "t"\nproblems = ["pond"]', 23, "unknown problem 'pond'"),
    ('candidate = "t[alpha=0.1]"', 'candidate = "t"\nproblems = []', 23, r"problems must be a list of names; got \[\]"),
    (
        'base = "base"\n',
        'base = "base"\ncandidate = "t"\n[[compare]]\nbase = "base"\n',
        25,
        r"t\[alpha=0.1\] against base by return is compared twice",
    ),
    ("keywords = {", "instances = 3\nkeywords = {", 7, "3 instances would be the same: name the keyword that has"),
    ("keywords = {", 'instance = "is_slippery"\nkeywords = {', 8, "is_slippery is set, and varied by the instances"),
    ("keywords = {", 'instance = "sed"\nkeywords = {', 6, "cannot make FrozenLake-v1"),
    ("keywords = {", "number = -1\nkeywords = {", 7, "number must be a whole number from 0 to"),
    (
        "keywords = {",
        'number = 7\n[[problem]]\nnumber = 7\nname = "pond"\nenv = "FrozenLake-v1"\nkeywords = {',
        9,
        "pond has the number 7 in the seeds, as lake has",
    ),
    ('"FrozenLake-v1"\nkeywords = { is_slippery = false }', '"CartPole-v1"', 8, "in a study file, settings = { bins"),
]


@pytest.mark.parametrize(("old", "new", "line", "message"), WRONG)
def test_what_is_wrong_is_said_with_its_line(old: str, new: str, line: int, message: str) -> None:
    with pytest.raises((ParameterError, UnknownNameError), match=message) as found:
        made(changed((old, new)))
    assert str(found.value).startswith(f"study file, line {line}: ")
    assert str(found.value).count("study file") == 1 + str(found.value).count("in a study file")


def test_a_study_needs_a_problem_and_an_algorithm() -> None:
    for text, kind in (("", "problem"), (LAKE[: LAKE.index("[[algorithm]]")], "algorithm")):
        with pytest.raises(ParameterError, match=f"at least one {kind}"):
            parse_study_file(text)


def test_the_number_of_runs_is_known_before_any_variant_is_made() -> None:
    grid = "grid = { alpha = { from = 0.1, to = 0.5, steps = 1_000_000 }, every = { from = 1, to = 9, steps = 100 } }"
    file = parse_study_file(LAKE[: LAKE.index("grid")] + grid)
    assert (file.n_variants, file.n_runs) == (100_000_001, 300_000_003)


def test_a_file_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match=re.escape(f"{tmp_path} is a folder: name a study file")):
        read_study_file(tmp_path)
    (tmp_path / "study.toml").write_bytes(b"title = '\xff'")
    with pytest.raises(ParameterError, match="must be text in UTF-8"):
        read_study_file(tmp_path / "study.toml")
    (tmp_path / "study.toml").write_text("runs = x")
    with pytest.raises(ParameterError, match=r"study\.toml, line 1: it is no TOML"):
        read_study_file(tmp_path / "study.toml")
    with pytest.raises(ParameterError, match=r"study\.toml, its last line: it is no TOML: Expected"):
        parse_study_file("title = 'x", "study.toml")
    with pytest.raises(ParameterError, match="too many brackets"):
        parse_study_file("x = " + "[" * 3000 + "]" * 3000)
