"""The pages that commands write, in a browser: silent, alone, in every window, readable for everybody."""

from collections.abc import Callable

import pytest

from tests.browser.subjects import SUBJECTS
from tests.browser.visit import SCHEMES, WIDTHS, Scheme, Visit

pytestmark = [pytest.mark.compiled, pytest.mark.slow]

Kept = Callable[[str, Scheme], Visit]
Written = Callable[[str], str]


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("name", SUBJECTS)
def test_a_page_says_nothing_and_asks_for_nothing(name: str, scheme: Scheme, kept: Kept, written: Written) -> None:
    assert kept(written(name), scheme).troubles == []


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("name", SUBJECTS)
def test_a_page_fits_into_every_window(name: str, width: int, kept: Kept, written: Written) -> None:
    assert kept(written(name), "light").too_wide(width) == []


@pytest.mark.parametrize("name", SUBJECTS)
def test_axe_finds_nothing_serious(name: str, kept: Kept, written: Written) -> None:
    assert kept(written(name), "light").axe() == []


@pytest.mark.parametrize("name", SUBJECTS)
def test_axe_finds_enough_contrast_in_the_dark(name: str, kept: Kept, written: Written) -> None:
    assert kept(written(name), "dark").axe("color-contrast") == []
