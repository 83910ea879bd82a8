"""The figures of README and the pages are those that were measured; what is said in words agrees with them."""

import importlib
import json
import sys
from pathlib import Path
from typing import Any

import pytest
from benchmarks import __main__ as benchmarks
from benchmarks.timing import Row
from docs.pictures import numbers

import tuckerl

CLAIMS = json.loads(numbers.CLAIMS.read_text("utf-8"))


@pytest.mark.parametrize(("page", "name"), list(numbers.PARTS))
def test_the_parts_of_pages_are_made_of_what_was_measured(page: str, name: str) -> None:
    written = numbers.part_pattern(name).search((numbers.ROOT / page).read_text("utf-8"))
    assert written is not None
    assert written[1].strip() == numbers.text_of(page, name), "run python -m docs.pictures.numbers"


def test_what_pages_say_in_words_is_what_came_out() -> None:
    """In the maze the tensor does the work, in the cart pole it does not, in robot rescue the step does harm."""
    found = {claim["id"]: (claim["verdict"], claim["tensor"]) for claim in CLAIMS}
    assert [found[name] for name in ("C3", "C4", "C5", "C6")] == [("holds", "yes")] * 4
    assert (found["C1"][0], found["C2"][0], found["C7"][0]) == ("holds", "holds", "does not hold")
    assert "yes" not in (found["C1"][1], found["C2"][1], found["C7"][1])


def test_results_are_taken_over_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(numbers, "CLAIMS", tmp_path / "kept.json")
    monkeypatch.setattr(numbers, "FIGURE", tmp_path / "kept.png")
    (tmp_path / "figures").mkdir()
    (tmp_path / "figures" / "fig11.png").write_bytes(b"a picture")
    (tmp_path / "claims.json").write_text(json.dumps(CLAIMS[:5]), "utf-8")
    with pytest.raises(SystemExit, match="has 5 claims, and the pages need all 10: run make reproduce"):
        numbers.take_over(tmp_path)
    assert not numbers.CLAIMS.exists()
    (tmp_path / "claims.json").write_text(json.dumps(CLAIMS), "utf-8")
    numbers.take_over(tmp_path)
    assert json.loads(numbers.CLAIMS.read_text("utf-8")) == CLAIMS
    assert numbers.FIGURE.read_bytes() == b"a picture"


def test_benchmarks_are_kept_beside_those_of_before(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kept = tmp_path / "bench.json"
    kept.write_text('{"traces": []}', "utf-8")
    row = Row("a step", "step", 1e-9, "C", 2e-9, 2.0)

    class Module:
        rows = staticmethod(lambda: [row])

    monkeypatch.setattr(importlib, "import_module", lambda name: Module)
    monkeypatch.setattr(sys, "argv", ["benchmarks", "kernels", "--out", str(kept)])
    benchmarks.main()
    assert json.loads(kept.read_text("utf-8")) == {"traces": [], "kernels": [row._asdict()]}


def test_the_citation_is_of_this_version() -> None:
    yaml: Any = importlib.import_module("yaml")  # which comes with Dask
    citation = yaml.safe_load((numbers.ROOT / "CITATION.cff").read_text("utf-8"))
    assert {"cff-version", "message", "title", "authors"} <= citation.keys(), "what the format asks for"
    assert (citation["title"], citation["version"]) == (tuckerl.__name__, tuckerl.__version__)
    readme = " ".join((numbers.ROOT / "README.md").read_text("utf-8").split())
    (paper,) = citation["references"]
    for said in (paper["title"], paper["collection-title"], f"pp. {paper['start']}\N{EN DASH}{paper['end']}"):
        assert said in readme


def test_readme_fits_two_screens() -> None:
    assert len((numbers.ROOT / "README.md").read_text("utf-8").splitlines()) <= 130
