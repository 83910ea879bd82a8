import pytest

from tuckerl.cli.settings import parse_settings
from tuckerl.errors import ParameterError


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
