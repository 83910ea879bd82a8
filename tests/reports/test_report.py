import base64
import hashlib
import json
import re
import sys
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from subprocess import run

import polars as pl
import pytest

from tests.reports.examples import (
    SCENARIO,
    SCENARIOS,
    ablation_of,
    claim,
    nothing_of,
    sensitivity_of,
    study_of,
    summary_of,
    tables_of,
    weights_claim,
)
from tuckerl.errors import OutputError
from tuckerl.reports.ablation import what_works
from tuckerl.reports.figure import RenderedFigure
from tuckerl.reports.page import embedded, inlined
from tuckerl.reports.report import MARKS, write_report
from tuckerl.reports.text import amount, amount_interval
from tuckerl.studies.assumptions import INVENTED, Assumption
from tuckerl.studies.summary import summarise

pytestmark = pytest.mark.xdist_group("report")  # whose pages are drawn once, in one process

CLAIMS = [claim("holds"), claim("does not hold", claim_id="C3"), claim("not decided", claim_id="C4"), weights_claim()]
LOADING = {"src", "href", "xlink:href", "action", "data", "poster", "srcset", "background", "formaction"}


class Page(HTMLParser):
    """All attributes and texts of a page."""

    def __init__(self, source: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.texts: list[str] = []
        self.feed(source)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_data(self, data: str) -> None:
        self.texts.append(data)

    def all(self, tag: str) -> list[dict[str, str | None]]:
        return [attributes for name, attributes in self.tags if name == tag]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("report") / "results"
    assert write_report(study_of(), CLAIMS, [summary_of()], folder) == folder / "report.html"
    return folder


@pytest.fixture(scope="module")
def source(folder: Path) -> str:
    return (folder / "report.html").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def page(source: str) -> Page:
    return Page(source)


def test_everything_is_written(folder: Path) -> None:
    names = ["fig10.png", "fig10.svg", "fig11.png", "fig11.svg", "omega-dyna-maze.png", "omega-dyna-maze.svg"]
    assert sorted(path.name for path in (folder / "figures").iterdir()) == names
    assert sorted(path.name for path in folder.iterdir()) == ["claims.json", "figures", "report.html"]
    assert json.loads((folder / "claims.json").read_text()) == [claim.to_dict() for claim in CLAIMS]


def test_writing_again_gives_the_same_bytes(folder: Path, tmp_path: Path) -> None:
    write_report(study_of(), CLAIMS, [summary_of()], tmp_path)
    for path in folder.rglob("*.*"):
        if path.is_file():
            assert (tmp_path / path.relative_to(folder)).read_bytes() == path.read_bytes(), path.name


def test_nothing_is_loaded(page: Page) -> None:
    for tag, attributes in page.tags:
        for name in LOADING & attributes.keys():
            value = attributes[name] or ""
            assert value.startswith(("#", "data:")), (tag, name, value)
        assert "url(" not in re.sub(r"url\(#[\w-]+\)", "", str(attributes)), attributes
    assert page.all("link") == page.all("iframe") == page.all("img") == []
    policy = [m["content"] or "" for m in page.all("meta") if m.get("http-equiv") == "Content-Security-Policy"]
    assert [p.startswith("default-src 'none';") and "http" not in p for p in policy] == [True]


def test_styles_load_nothing(source: str) -> None:
    for style in re.findall(r"<style.*?</style>", source.split("<script>")[0], re.DOTALL):
        assert "@import" not in style
        assert "url(" not in style


def test_only_the_pages_own_scripts_run(folder: Path, source: str) -> None:
    policy = re.findall(r"script-src ([^;]*);", source)[0].split()
    scripts = re.findall(r"<script>(.*?)</script>", source, re.DOTALL)
    digests = [base64.b64encode(hashlib.sha256(script.encode()).digest()).decode() for script in scripts]
    assert policy == [f"'sha256-{digest}'" for digest in digests]
    assert digests


def test_data_in_a_page_are_no_markup() -> None:
    evil = {"name": "</script><script>alert('&')</script>", "numbers": [1, None]}
    element = embedded(evil, 'a"b')
    assert element.startswith('<script type="application/json" id="a&#34;b">')
    inside = element[element.index(">") + 1 : element.rindex("<")]
    assert not set("<>&") & set(inside)
    assert json.loads(inside) == evil


def test_every_heading_is_in_the_contents(source: str) -> None:
    contents = source[source.index('<nav class="contents"') : source.index("</nav>")]
    listed = re.findall(r'href="#([^"]+)"', contents)
    assert listed == re.findall(r'<h2 id="([^"]+)"', source)
    assert len(listed) > 4


def test_ids_are_unique_and_references_lead_somewhere(page: Page) -> None:
    ids = [attributes["id"] for _, attributes in page.tags if "id" in attributes]
    assert len(ids) == len(set(ids))
    for _, attributes in page.tags:
        for name, value in attributes.items():
            for target in re.findall(r"url\(#([\w-]+)\)", value or ""):
                assert target in ids
            if name in ("href", "xlink:href", "aria-labelledby") and not (value or "").startswith("data:"):
                assert (value or "").removeprefix("#") in ids


def test_claims_verdicts_and_assumptions_are_all_there(page: Page) -> None:
    texts = [text.strip() for text in page.texts]
    for one in CLAIMS:
        assert one.id in texts
        assert one.claim in texts
        assert one.detail in texts
    assert [text for text in texts if text in ("holds", "does not hold", "not decided")].count("does not hold") >= 1
    for assumption in SCENARIO.assumptions:
        assert texts.count(assumption.text) == 1
    for variant in SCENARIO.variants:
        assert variant.name in texts
    assert f"tuckerl reproduce {SCENARIO.name} --quick --runs 3 --episodes 20 --seed 5" in texts


def test_claims_come_first(source: str) -> None:
    assert source.index("<table") < source.index(CLAIMS[0].claim) < source.index('id="reading"')


def test_the_page_is_accessible(page: Page) -> None:
    assert page.all("html") == [{"lang": "en"}]
    assert all("scope" in attributes for attributes in page.all("th"))
    assert len(page.all("caption")) == len(page.all("table"))
    figures = page.all("figure")
    drawn = [svg for svg in page.all("svg") if svg.get("role") == "img"]
    assert len(drawn) == len(figures) == 3
    assert all(svg["aria-label"] for svg in drawn)


def test_names_are_escaped(tmp_path: Path) -> None:
    evil = "<script>alert('&')</script>$x$"
    first, *others = SCENARIO.variants
    assumed = (Assumption(INVENTED, evil),)
    variants = (replace(first, name=evil), *others)
    scenario = replace(SCENARIO, title=evil, variants=variants, record_paths_of=(evil,), assumptions=assumed)
    bad = claim()._replace(claim=evil, detail=evil, verdict=evil)
    path = write_report(study_of(scenario), [bad], [summary_of(scenario)], tmp_path)
    page = Page(path.read_text(encoding="utf-8"))
    assert all(script.get("type") == "application/json" for script in page.all("script") if script)
    assert page.texts.count(evil) >= 5


def test_inlined_figures_keep_no_comment_and_escape_their_description() -> None:
    svg = '<?xml?><svg viewBox="0 0 1 2"><g id="figure_1"><!-- <b> --><use href="#a"/><path id="a"/></g></svg>'
    assert inlined(RenderedFigure("fig", "", "", '"<', svg.encode(), b"")) == (
        '<svg viewBox="0 0 1 2" role="img" aria-label="&#34;&lt;"><g id="fig-figure_1"><use href="#fig-a"/>'
        '<path id="fig-a"/></g></svg>'
    )


def test_a_study_that_lost_every_run_has_a_report(tmp_path: Path) -> None:
    lost = claim("not decided", (float("nan"),) * 3, (float("nan"),) * 3, n_diverged=3)
    source = write_report(study_of(), [lost], [nothing_of()], tmp_path).read_text(encoding="utf-8")
    assert "NaN" not in source.split("<script>")[0]
    assert "no finished episode" in source


def test_a_folder_that_cannot_be_made_is_said(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="cannot make the folder"):
        write_report(study_of(), [], [], tmp_path / "file")


def test_scenarios_without_texts_and_claims_are_reported(tmp_path: Path) -> None:
    scenario = replace(SCENARIO, name="other", comparisons=(), figures=())
    source = write_report(study_of(scenario), [], [summary_of(scenario)], tmp_path).read_text(encoding="utf-8")
    assert [figure["id"] for figure in Page(source).all("figure")] == ["paths-other", "curves-other", "omega-other"]
    assert "tuckerl reproduce other" in source


def test_a_run_that_diverged_is_counted(tmp_path: Path) -> None:
    study = study_of()
    claims, summaries = summarise(study, tables_of())
    source = write_report(study, claims, summaries, tmp_path).read_text(encoding="utf-8")
    assert re.findall(r'<th scope="row" id="claim-C\d+">(C\d+)</th>', source) == ["C3", "C4", "C5", "C6", "C9"]
    row = source[source.index('<th scope="row"><code>dyna-ht-1</code>') :]
    assert re.findall(r'data-label="(?:Runs|Diverged)">(\d+)<', row)[:2] == ["2", "1"]
    row = source[source.index('<th scope="row" id="claim-C5">C5</th>') :]
    assert re.findall(r'data-label="(?:Pairs used|Diverged)">(\d+)<', row)[:2] == ["2", "1"]


def test_a_curve_is_paired_with_the_base_over_the_runs_that_both_finished() -> None:
    tables = tables_of()
    curve = summarise(study_of(), tables)[1][0].curves[1]
    steps = {
        name: tables.runs.filter((pl.col("variant") == name) & (pl.col("run") < 2))["steps"].to_numpy()
        for name in ("dyna-ht-1", "dyna-h")
    }
    assert (curve.variant, curve.n_runs, curve.n_diverged) == ("dyna-ht-1", 2, 1)
    assert curve.against_base.mean[-1] == pytest.approx((steps["dyna-ht-1"] - steps["dyna-h"]).sum() / 2)
    assert curve.against_base.low[-1] < curve.against_base.mean[-1] < curve.against_base.high[-1]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """The report of three scenarios with all that can be on it."""
    folder = tmp_path_factory.mktemp("whole")
    summaries = [summary_of(scenario) for scenario in SCENARIOS]
    ablations = [ablation_of(scenario) for scenario in SCENARIOS]
    page = write_report(
        study_of(*SCENARIOS), CLAIMS, summaries, folder, ablations=ablations, sensitivity=sensitivity_of()
    )
    return folder, page.read_text(encoding="utf-8")


@pytest.mark.slow
def test_three_scenarios_have_all_their_figures(whole: tuple[Path, str]) -> None:
    folder, _ = whole
    names = ["fig9", "fig10", "fig11", "fig13", "sensitivity"]
    names += [f"{kind}-{scenario.name}" for kind in ("omega", "ablation") for scenario in SCENARIOS]
    files = sorted(f"{name}.{ending}" for name in names for ending in ("png", "svg"))
    assert sorted(path.name for path in (folder / "figures").iterdir()) == files


def test_every_figure_and_table_of_three_scenarios_is_on_the_page(whole: tuple[Path, str]) -> None:
    page = Page(whole[1])
    ids = [attributes["id"] for _, attributes in page.tags if "id" in attributes]
    assert len(ids) == len(set(ids))
    assert [figure["id"] for figure in page.all("figure")] == [
        *("fig9", "omega-cart-pole", "ablation-cart-pole"),
        *("fig10", "fig11", "omega-dyna-maze", "ablation-dyna-maze"),
        *("fig13", "omega-robot-rescue", "ablation-robot-rescue"),
        "sensitivity",
    ]
    assert len(page.all("caption")) == len(page.all("table")) == 3 + 2 * len(SCENARIOS) + 1
    assert all("scope" in attributes for attributes in page.all("th"))
    assert "nan" not in " ".join(page.texts).lower().split()


@pytest.mark.slow
def test_assumptions_are_stated_once_with_their_marks(whole: tuple[Path, str]) -> None:
    texts = [text.strip() for text in Page(whole[1]).texts]
    every = {assumption for scenario in SCENARIOS for assumption in scenario.assumptions}
    assert [texts.count(assumption.text) for assumption in every] == [1] * len(every)
    for mark, meaning in MARKS.items():
        assert f": {meaning}" in texts
        assert texts.count(mark) == 1 + sum(assumption.mark == mark for assumption in every)
    place = texts.index(SCENARIOS[2].assumptions[-1].text)
    assert next(text for text in texts[place + 1 :] if text) == "Robot rescue"
    shared = texts.index(SCENARIOS[2].assumptions[0].text)
    assert next(text for text in texts[shared + 1 :] if text) == "all"


def test_ablations_and_cells_are_on_the_page(whole: tuple[Path, str]) -> None:
    texts = " ".join(" ".join(Page(whole[1]).texts).split())
    for ablation in (ablation_of(scenario) for scenario in SCENARIOS):
        assert what_works(ablation) in texts
        for one in ablation.steps:
            assert one.label in texts
            for difference in (one.difference, one.added):
                assert f"{amount(difference)} {amount_interval(difference)}".strip() in texts
    assert texts.count("(changed)") == 2
    assert "\N{MINUS SIGN}40.0 % [\N{MINUS SIGN}50.0, \N{MINUS SIGN}30.0]" in texts
    assert "--sensitivity" in texts


def test_a_page_without_ablations_and_cells_does_not_speak_of_them(source: str) -> None:
    body = source.split("<script>")[0]
    assert "Where the gain comes from" not in body
    assert "--sensitivity" not in body
    assert 'id="readings"' not in body
    assert "#readings" not in body


def test_a_scenario_is_told_by_its_longest_or_shortest_episode(whole: tuple[Path, str]) -> None:
    heads = [text for text in Page(whole[1]).texts if text in ("Longest episode", "Shortest episode")]
    assert heads == ["Longest episode", "Shortest episode", "Shortest episode"]


def test_best_episodes_are_the_longest_where_longer_is_better() -> None:
    tables = tables_of()
    longest = summarise(study_of(replace(SCENARIO, measure="balance")), tables)[1][0].best_episodes
    shortest = summarise(study_of(), tables)[1][0].best_episodes
    by_agent = tables.runs.filter(pl.col("variant") == "dyna-h").group_by("run", "agent")
    assert longest["dyna-h"] == pytest.approx(by_agent.agg(pl.col("steps").max())["steps"].mean())
    assert shortest["dyna-h"] == pytest.approx(by_agent.agg(pl.col("steps").min())["steps"].mean())


def test_importing_the_package_imports_no_drawing_library() -> None:
    code = "import sys, tuckerl.reports; print([m for m in ('matplotlib', 'jinja2') if m in sys.modules])"
    done = run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
