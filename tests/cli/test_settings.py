import pytest

from tuckerl import UCB, EpsilonGreedy, Exponential, Greedy, Harmonic, Linear, Softmax
from tuckerl.cli.settings import parse_parameters, parse_searches, parse_settings
from tuckerl.errors import ParameterError, UnknownNameError
from tuckerl.studies.search_space import Choices
from tuckerl.training.policies.policy import Policy


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("alpha=0.2", 0.2),
        ("ranks=15,3,9,1", (15, 3, 9, 1)),
        ("ranks = (15, 3, 9, 1)", (15, 3, 9, 1)),
        ("bins=[10, 10]", [10, 10]),
        ("share=max", "max"),
        ("share='max'", "max"),
        ("is_slippery=false", False),
        ("is_slippery=True", True),
        ("heuristic=None", None),
        ("desc=null", None),
        ("formula=a=b", "a=b"),
        ("alpha=1e999", "1e999"),
        ("alpha=nan", "nan"),
        ("data=b'x'", "b'x'"),
        ("set={1,2}", "{1,2}"),
        ("alpha=-1", -1),
        ("alpha=0.1.2", "0.1.2"),
        ("alpha=__import__('os')", "__import__('os')"),
    ],
)
def test_values_are_literals_or_else_text(text: str, value: object) -> None:
    ((_, got),) = parse_settings([text]).items()
    assert got == value
    assert type(got) is type(value)


def test_names_keep_their_order_and_side() -> None:
    assert parse_settings(["base.alpha=1", "alpha=2"]) == {"base.alpha": 1, "alpha": 2}


@pytest.mark.parametrize("text", ["alpha", "=1", "alpha=", "", " = "])
def test_what_is_no_setting_is_said(text: str) -> None:
    with pytest.raises(ParameterError, match=r"--env-set must be given NAME=VALUE, such as alpha=0\.2; got "):
        parse_settings([text], "--env-set")


def test_a_name_that_comes_twice_is_refused() -> None:
    with pytest.raises(ParameterError, match="--set must be given alpha once; got alpha=1 and 'alpha=2'"):
        parse_settings(["alpha=1", "alpha=2"])


@pytest.mark.parametrize(
    ("text", "schedule"),
    [
        ("Linear(0.2,0,400)", Linear(0.2, 0.0, 400)),
        (" Linear ( 0.2 , 0, episodes = 400 ) ", Linear(0.2, 0.0, 400)),
        ("Linear(episodes=400, stop=0, start=1e-1)", Linear(0.1, 0.0, 400)),
        ("Exponential(.5)", Exponential(0.5)),
        ("Exponential(0.5, 0.99, minimum=0.01)", Exponential(0.5, 0.99, 0.01)),
        ("Harmonic(0.5, half_after=1000)", Harmonic(0.5, 1000.0)),
    ],
)
def test_schedules_are_given_by_name(text: str, schedule: object) -> None:
    assert parse_parameters([f"epsilon={text}"]) == {"epsilon": schedule}
    assert parse_parameters([f"candidate.epsilon={schedule!r}"]) == {"candidate.epsilon": schedule}


@pytest.mark.parametrize(
    ("text", "policy"),
    [
        ("Greedy()", Greedy()),
        ("EpsilonGreedy(0.2, decay=0.9)", EpsilonGreedy(0.2, 0.9)),
        ("Softmax(0.5)", Softmax(0.5)),
        ("UCB(c = 2)", UCB(2.0)),
        ("Softmax(Linear(5, 0.1, episodes=400))", Softmax(Linear(5.0, 0.1, 400))),
        ("EpsilonGreedy( epsilon=Linear(1,0,5) , decay=1)", EpsilonGreedy(Linear(1.0, 0.0, 5))),
    ],
)
def test_policies_are_given_by_name(text: str, policy: Policy) -> None:
    for name in ("policy", "base.policy"):
        given = parse_parameters([f"{name}={text}"])[name]
        assert type(given) is type(policy)
        assert repr(given) == repr(policy)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("SoftMax(1)", r"policy: unknown policy 'SoftMax': did you mean 'Softmax'\?; policies are EpsilonGreedy\(eps"),
        ("OwnDistribution(1)", "unknown policy 'OwnDistribution'"),
        ("Softmax()", r"must be given Softmax\(temperature\) with numbers in it; got Softmax\(\): missing"),
        ("Softmax(0)", "temperature must be a finite number above 0; got 0.0"),
        ("Softmax(Lin(1,2,3))", "policy: unknown schedule 'Lin'"),
        ("Softmax(Linear(5,0,9))", "temperature must stay above 0 in all episodes"),
        ("Softmax(Linear(5,len('ab'),9))", "could not convert string to float"),
        ("UCB(1, c=2)", "multiple values for argument 'c'"),
    ],
)
def test_what_is_no_policy_is_said(text: str, message: str) -> None:
    with pytest.raises((ParameterError, UnknownNameError), match=message):
        parse_parameters([f"policy={text}"])


def test_other_values_are_as_in_all_settings() -> None:
    texts = ["alpha=0.2", "ranks=(15, 3, 9, 1)", "share=max", "bins=[10, 10]"]
    assert parse_parameters(texts) == parse_settings(texts)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("Liner(0.2,0,400)", r"epsilon: unknown schedule 'Liner': did you mean 'Linear'\?; schedules are Exponential"),
        ("__import__('os')", r"unknown schedule '__import__'.*Linear\(start, stop, episodes\)$"),
        ("f(1)(2)", "unknown schedule 'f'"),
        (
            "Linear()",
            r"must be given Linear\(start, stop, episodes\) with numbers in it; got Linear\(\): missing",
        ),
        ("Linear(0.2,0)", "missing a required argument: 'episodes'"),
        ("Linear(0.2,0,400,1)", "too many positional arguments"),
        ("Linear(0.2,0,400,stop=1)", "multiple values for argument 'stop'"),
        ("Linear(start=0.2,0,400)", "0 comes after start"),
        ("Linear(0.2,0,episodes=1,episodes=2)", "'episodes=2' is out of place"),
        ("Linear(0.2,0,=1)", "'=1' is out of place"),
        ("Linear(0.2,,400)", "could not convert string to float: ''"),
        ("Linear(0.2,0,len('ab'))", r"could not convert string to float: \"len\('ab'\)\""),
        ("Linear(0.2,0,400,duration=1)", "unexpected keyword argument 'duration'"),
        ("Linear(-2,0,400)", r"start must be a finite number of at least 0; got -2\.0"),
        ("Linear(0.2,0,4.5)", "episodes must be a whole number"),
        ("Linear(nan,0,4)", "start must be a finite number"),
        ("Exponential(0.5, decay=2)", r"Exponential\(start, decay=1, minimum=0\) with numbers.*decay must be a number"),
    ],
)
def test_what_is_no_schedule_is_said(text: str, message: str) -> None:
    with pytest.raises((ParameterError, UnknownNameError), match=message) as raised:
        parse_parameters([f"epsilon={text}"])
    assert len(str(raised.value)) <= 600
    assert "epsilon" in str(raised.value)


def test_none_is_a_name_where_names_are_taken() -> None:
    texts = ["weights=none", "candidate.share=None", "ranks=none"]
    assert parse_parameters(texts) == {"weights": "none", "candidate.share": "none", "ranks": None}
    assert parse_searches(["weights=paper,none"]) == {"weights": Choices(("paper", "none"))}
