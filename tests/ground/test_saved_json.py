"""JSON from strangers: what is read can be written again, and means one thing."""

import pytest

from tuckerl.errors import SavedFileError
from tuckerl.saved_json import parse_json


def test_what_is_written_is_read() -> None:
    assert parse_json('{"a": [1, 2.5, null, true, "é"]}'.encode()) == {"a": [1, 2.5, None, True, "é"]}


@pytest.mark.parametrize(
    "text",
    [
        b"",
        b"{",
        b"\xff",
        b'"\\ud800"',  # half a character: it can be read, and not be written
        b'{"a": 1, "a": 2}',
        b"NaN",
        b"-Infinity",
        b"1e999",
        b"[" * 100_000,
    ],
    ids=lambda text: repr(text[:20]),
)
def test_what_cannot_be_written_again_is_refused(text: bytes) -> None:
    with pytest.raises(SavedFileError, match="its text is no JSON that can be read"):
        parse_json(text)
