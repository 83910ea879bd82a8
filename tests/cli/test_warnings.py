"""Warnings of this library are one line each in commands."""

import warnings

import pytest

from tuckerl import errors
from tuckerl.cli.warnings import OWN, short_warnings

KINDS = [kind for kind in vars(errors).values() if isinstance(kind, type) and issubclass(kind, Warning)]


@pytest.mark.parametrize("kind", KINDS)
def test_each_of_the_librarys_warnings_is_one_line(kind: type[Warning], capsys: pytest.CaptureFixture[str]) -> None:
    assert set(OWN) == set(KINDS)
    with short_warnings():
        for _ in range(2):
            warnings.warn("it is late", kind, stacklevel=1)
    assert capsys.readouterr().err == "tuckerl: warning: it is late\n"
