import tomllib
from collections.abc import Iterator
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from tuckerl.studies.toml_lines import Path, lines_of

TEXT = r"""# c [x] = "
a = 1 # "no
b.c."d e".f = 2.5
"q\"x" = [1, [2,
  3], { z = 1, y.w = [ 'a#', "]" ] },
]
t = '''
[not]
x = 1
'''
u = 1979-05-27 07:32:00
v = -1e5
[tab]
x = {}
[tab.sub."x.y"]
z = []
[[arr]]
n = 1
[arr.in]
m = 2
[[arr.deep]]
k = 1
[[arr.deep]]
k = 2
[[arr]]
n = 3
[[arr.deep]]
"""
LINES: dict[Path, int] = {
    ("a",): 2,
    ("b",): 3,
    ("b", "c"): 3,
    ("b", "c", "d e"): 3,
    ("b", "c", "d e", "f"): 3,
    ('q"x',): 4,
    ('q"x', 0): 4,
    ('q"x', 1): 4,
    ('q"x', 1, 0): 4,
    ('q"x', 1, 1): 5,
    ('q"x', 2): 5,
    ('q"x', 2, "z"): 5,
    ('q"x', 2, "y"): 5,
    ('q"x', 2, "y", "w"): 5,
    ('q"x', 2, "y", "w", 0): 5,
    ('q"x', 2, "y", "w", 1): 5,
    ("t",): 7,
    ("u",): 11,
    ("v",): 12,
    ("tab",): 13,
    ("tab", "x"): 14,
    ("tab", "sub"): 15,
    ("tab", "sub", "x.y"): 15,
    ("tab", "sub", "x.y", "z"): 16,
    ("arr",): 17,
    ("arr", 0): 17,
    ("arr", 0, "n"): 18,
    ("arr", 0, "in"): 19,
    ("arr", 0, "in", "m"): 20,
    ("arr", 0, "deep"): 21,
    ("arr", 0, "deep", 0): 21,
    ("arr", 0, "deep", 0, "k"): 22,
    ("arr", 0, "deep", 1): 23,
    ("arr", 0, "deep", 1, "k"): 24,
    ("arr", 1): 25,
    ("arr", 1, "n"): 26,
    ("arr", 1, "deep"): 27,
    ("arr", 1, "deep", 0): 27,
}


def paths(value: Any, path: Path = ()) -> Iterator[Path]:
    if path:
        yield path
    parts = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, part in parts:
        yield from paths(part, (*path, key))


def test_every_key_and_entry_has_its_line() -> None:
    assert lines_of(TEXT) == LINES
    assert set(LINES) == set(paths(tomllib.loads(TEXT)))


QUOTES = ('"""', "'''", '"', "'")


@st.composite
def written(draw: st.DrawFn) -> str:
    """Write a value in some way: on one line or over several, texts with all that could be taken for a mark."""
    kind = draw(st.sampled_from(["number", "text", "list", "table"]))
    if kind == "number":
        return draw(st.sampled_from(["1", "-2.5", "true", "2020-01-01T00:00:00Z"]))
    if kind == "text":
        quote = draw(st.sampled_from(QUOTES))
        inside = draw(st.text("[]{}=,# x" + ("\n" if len(quote) == 3 else ""), max_size=8))
        return quote + inside + quote
    if kind == "list":
        space = draw(st.sampled_from([" ", "\n", " # ]\n"]))
        return (
            "[" + "".join(space + draw(written()) + space + "," for _ in range(draw(st.integers(0, 2)))) + space + "]"
        )
    keys = draw(st.lists(st.sampled_from(["a", "b.c", '"d.]"', "'='"]), max_size=2, unique=True))
    return "{" + ", ".join(f"{key} = {draw(written())}" for key in keys) + "}"


@given(st.lists(written(), max_size=4))
def test_of_any_text_the_paths_are_those_that_are_there(values: list[str]) -> None:
    text = "".join(f"# [[\n[[part]]\nkey{place} = {value}\n" for place, value in enumerate(values))
    lines = lines_of(text)
    assert set(lines) == set(paths(tomllib.loads(text)))
    for place in range(len(values)):
        assert text.splitlines()[lines["part", place, f"key{place}"] - 1].startswith(f"key{place} =")
