"""Small study files of which everything is known."""

LAKE = """\
runs = 3
episodes = 20

[[problem]]
name = "lake"
env = "FrozenLake-v1"
keywords = { is_slippery = false }

[[algorithm]]
name = "base"
algorithm = "sarsa-lambda"
settings = { alpha = 0.1 }

[[algorithm]]
name = "t"
algorithm = "tsarsa-lambda"
grid = { alpha = [0.1,
                  0.2] }

[[compare]]
base = "base"
candidate = "t[alpha=0.1]"
"""


def changed(*changes: tuple[str, str]) -> str:
    """Return the text with each first text in it replaced once by the second."""
    text = LAKE
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new, 1)
    return text
