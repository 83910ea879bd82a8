import io
import json
import re
import shutil
from contextlib import redirect_stderr
from pathlib import Path

import polars as pl
import pytest

import tuckerl
from tests.reports.test_report import LOADING, Page
from tests.studies.study_texts import LAKE, changed
from tuckerl.errors import OutputConflictError, ParameterError, ParameterTypeError, UnknownNameError
from tuckerl.reports.curves import PROBLEM
from tuckerl.reports.study_page import MOST_SENTENCES, outcome, write_study
from tuckerl.studies import store
from tuckerl.studies.estimates import reached_of
from tuckerl.studies.executed_code import _digest
from tuckerl.studies.runs import run_identities
from tuckerl.studies.statistics import MEASURES
from tuckerl.studies.store import Store
from tuckerl.studies.study import Variant
from tuckerl.studies.study_file import parse_study_file
from tuckerl.studies.study_folder import NOTHING_KEPT, play_study
from tuckerl.studies.study_making import study_of
from tuckerl.studies.study_result import MOST_CURVES, summarise_study
from tuckerl.studies.tables import SCHEMAS


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder in which a small study was played whole, and reported."""
    folder = tmp_path_factory.mktemp("study") / "lake"
    study = tuckerl.Study.from_text(LAKE)
    study.run(folder, workers=1)
    assert study.report(folder).page == folder / "report.html"
    return folder


def test_a_study_is_played_as_its_learners_alone(folder: Path) -> None:
    study = tuckerl.Study.from_folder(folder)
    assert study.problems == ("lake",)
    assert study.variants == ("base", "t[alpha=0.1]", "t[alpha=0.2]", "t[alpha=0.1]-constant")
    assert repr(study) == "Study of 1 problem, 4 variants and 12 runs"
    runs = study.run(folder, workers=1).runs
    scenario = study._plan.scenarios[0]
    alone = scenario.variants[1].make(scenario.problem(0), study._plan.run_seed(scenario, 0, 2)).learn(episodes=20)
    assert runs.filter(variant="t[alpha=0.1]", run=2)["return"].to_list() == alone.returns[:, 0].tolist()


def test_the_folder_holds_the_file_so_that_nothing_else_is_needed(folder: Path) -> None:
    assert (folder / "study.toml").read_text() == LAKE
    names = {path.name for path in folder.iterdir()}
    assert {"report.html", "comparisons.json", "runs.parquet", "study.toml"} <= names
    assert sorted(path.name for path in (folder / "figures").iterdir()) == ["curves-1.png", "curves-1.svg"]


def test_finished_runs_are_not_played_again(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = (folder / "runs.parquet").read_bytes()
    study = tuckerl.Study.from_folder(folder)
    monkeypatch.delattr(Variant, "make")
    study.run(folder, workers=1)
    assert (folder / "runs.parquet").read_bytes() == before
    status = study.status(folder)
    assert (status.n_runs, status.n_finished, status.n_diverged) == (12, 12, 0)


def test_the_status_tells_means_with_intervals(folder: Path, tmp_path: Path) -> None:
    study = tuckerl.Study.from_text(LAKE)
    runs = pl.read_parquet(folder / "runs.parquet")
    for one in study.status(folder).variants:
        means = runs.filter(variant=one.estimate.variant).group_by("run").agg(pl.col("return").mean())["return"]
        assert one.estimate.mean == pytest.approx(means.mean())
        assert (one.problem, one.n_runs, one.n_finished) == ("lake", 3, 3)
    nothing = study.status(tmp_path / "none")
    assert (nothing.n_runs, nothing.n_finished) == (12, 0)
    assert not (tmp_path / "none").exists(), "asking makes nothing"


def test_some_runs_for_now_and_the_rest_later_are_the_same_bytes(folder: Path, tmp_path: Path) -> None:
    study = tuckerl.Study.from_text(LAKE)
    study.run(tmp_path, workers=1, runs=1)
    assert [one.n_finished for one in study.status(tmp_path).variants] == [1] * 4
    assert "8 runs of 12 are not finished yet" in study.report(tmp_path).page.read_text()
    study.run(tmp_path, workers=1)
    for name in ("runs.parquet", "weights.parquet", "study.toml"):
        assert (tmp_path / name).read_bytes() == (folder / name).read_bytes()


def test_more_runs_variants_and_problems_play_only_what_is_new(folder: Path, tmp_path: Path) -> None:
    grown = Path(shutil.copytree(folder, tmp_path / "grown"))
    pond = '[[problem]]\nname = "pond"\nenv = "FrozenLake-v1"\nruns = 1\n\n[[problem]]'
    text = changed(("runs = 3", "runs = 4"), ("[0.1,", "[0.05, 0.1,"), ("[[problem]]", pond))
    file, told = parse_study_file(text), list[tuple[int, int]]()
    tables = play_study(
        file, study_of(file), grown, workers=1, progress=lambda runs: told.append((runs.n_done, runs.n_total))
    )
    assert told[0] == (12, 5 * 4 + 5)
    assert (grown / "study.toml").read_text() == text
    before = pl.read_parquet(folder / "runs.parquet")
    kept = tables.runs.join(before.select("scenario", "variant", "run").unique(), on=["scenario", "variant", "run"])
    order = ["variant", "run", "episode"]
    assert kept.sort(order).equals(before.sort(order))
    assert tables.runs.filter(scenario="pond")["variant"].n_unique() == 5


def test_a_folder_can_be_looked_at_while_another_process_writes_there(folder: Path) -> None:
    study = tuckerl.Study.from_folder(folder)
    with Store(folder, study._plan):
        assert study.status(folder).n_finished == 12
        assert study.report(folder).page.exists()
        with pytest.raises(OutputConflictError, match="in use"):
            study.run(folder, workers=1)


def test_what_failed_and_what_other_code_has_played_is_said(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    copy = Path(shutil.copytree(folder, tmp_path / "copy"))
    study = tuckerl.Study.from_folder(copy)
    assert (study.status(copy).n_failed, study.status(copy).n_of_other_code) == (0, 0)
    monkeypatch.setattr(store, "run_code", lambda scenario, variant: {"another": "code"})
    status = study.status(copy)
    assert (status.n_finished, status.n_of_other_code) == (0, 12)
    assert "12 finished runs left out, as other code has played them" in study.report(copy).page.read_text()
    monkeypatch.undo()
    (copy / "failures").mkdir()
    (copy / "failures" / f"{next(iter(run_identities(study._plan).values()))}.txt").write_text("ValueError: no")
    assert study.status(copy).n_failed == 1
    assert "1 run ended with an error" in study.report(copy).page.read_text()


def test_a_changed_study_is_refused_and_leaves_the_folder_as_it_is(folder: Path) -> None:
    other = tuckerl.Study.from_text(changed(("episodes = 20", "episodes = 10")))
    with pytest.raises(OutputConflictError, match="episodes is 20 there and 10 now"):
        other.run(folder, workers=1)
    assert (folder / "study.toml").read_text() == LAKE


def test_the_page_shows_all_that_came_out_and_loads_nothing(folder: Path) -> None:
    source = (folder / "report.html").read_text(encoding="utf-8")
    page = Page(source)
    for tag, attributes in page.tags:
        for name in LOADING & attributes.keys():
            assert (attributes[name] or "").startswith(("#", "data:")), (tag, name)
    assert page.all("link") == page.all("img") == []
    ids = [attributes["id"] for _, attributes in page.tags if "id" in attributes]
    assert len(ids) == len(set(ids))
    study = tuckerl.Study.from_folder(folder)
    shown = [re.sub(r"\s+", " ", text).strip() for text in page.texts]
    assert set(study.variants) <= set(shown)
    for words in study.report(folder).outcomes:
        assert words in shown
    assert LAKE.strip() in source.replace("&#34;", '"')


def test_numbers_are_beside_the_page(folder: Path) -> None:
    (lake,) = json.loads((folder / "comparisons.json").read_text())
    assert (lake["problem"], lake["measure"]) == ("lake", "return")
    assert [one["variant"] for one in lake["variants"]] == list(tuckerl.Study.from_folder(folder).variants)
    (compared,) = lake["comparisons"]
    assert (compared["base"], compared["candidate"], compared["control"]) == (
        "base",
        "t[alpha=0.1]",
        "t[alpha=0.1]-constant",
    )
    assert compared["runs"] == 3


def test_an_unfinished_study_is_reported_as_far_as_it_is(folder: Path, tmp_path: Path) -> None:
    study = tuckerl.Study.from_text(LAKE)
    tables = study.run(folder, workers=1)
    some = tables._replace(
        **{
            name: frame.filter((pl.col("run") < 2) & (pl.col("variant") != "t[alpha=0.1]"))
            for name, frame in tables._asdict().items()
        }
    )
    (result,) = summarise_study(study._plan, reached_of(study._plan, some))
    assert [one.n_runs for one in result.estimates] == [2, 0, 2, 2]
    assert [curve.variant for curve in result.curves.curves] == ["base", "t[alpha=0.2]", "t[alpha=0.1]-constant"]
    assert result.comparisons[0].difference.n_pairs == 0
    (empty,) = summarise_study(study._plan, reached_of(study._plan, NOTHING_KEPT.tables))
    assert empty.curves.curves == ()
    status = study.status(tmp_path)
    assert outcome([empty], status) == (
        "Of 1 comparison, the candidate is 1 not decided. 12 runs of 12 are not finished yet."
    )


def test_of_very_many_variants_the_best_are_drawn() -> None:
    grid = "grid = { alpha = { from = 0.01, to = 0.4, steps = 40 } }"
    study = tuckerl.Study.from_text(LAKE[: LAKE.index("grid")] + grid)
    scenario = study._plan.scenarios[0]
    rows = [
        {"scenario": "lake", "variant": variant.name, "instance": 0, "run": run, "agent": 0, "episode": 0}
        | {"steps": 1, "return": float(-place), "diverged": False}
        for place, variant in enumerate(reversed(scenario.variants))
        for run in range(2)
    ]
    tables = NOTHING_KEPT.tables._replace(runs=pl.DataFrame(rows, schema=SCHEMAS["runs"]))
    (result,) = summarise_study(study._plan, reached_of(study._plan, tables))
    shown = [curve.variant for curve in result.curves.curves]
    assert shown == ["base", *study.variants[-MOST_CURVES + 1 :]]
    assert f"Of {len(study.variants)} variants, base and the best." in PROBLEM.caption(result)
    assert result.measure == MEASURES["return"]


def test_of_very_many_comparisons_a_table_tells(tmp_path: Path) -> None:
    grid = f"grid = {{ alpha = {{ from = 0.01, to = 0.4, steps = {MOST_SENTENCES + 1} }} }}\n"
    text = LAKE[: LAKE.index("grid")] + grid + '[[compare]]\nbase = "base"\ncandidate = "t"\n'
    study = tuckerl.Study.from_text(text)
    results, status = summarise_study(study._plan, reached_of(study._plan, NOTHING_KEPT.tables)), study.status(tmp_path)
    source = write_study(study._file, study._plan, results, status, tmp_path).read_text()
    assert len(results[0].comparisons) == source.count("<code>base</code></div></td>") == MOST_SENTENCES + 1
    assert "There is no pair of" not in source
    (few,) = results
    source = write_study(
        study._file, study._plan, [few._replace(comparisons=few.comparisons[:2])], status, tmp_path
    ).read_text()
    assert source.count("There is no pair of") == 2


def test_a_table_of_all_runs_is_exported_with_what_was_varied(folder: Path, tmp_path: Path) -> None:
    study = tuckerl.Study.from_folder(folder)
    path = study.export(folder, tmp_path / "new" / "runs.parquet")
    frame = pl.read_parquet(path)
    assert frame.columns == [
        *("problem", "variant", "algorithm", "alpha", "run", "agent", "episode", "steps", "return", "diverged"),
    ]
    assert frame.height == 12 * 20
    assert frame.filter(variant="t[alpha=0.2]")["alpha"].unique().to_list() == [0.2]
    assert frame.filter(variant="t[alpha=0.1]-constant")["alpha"].unique().to_list() == [0.1]
    assert frame["algorithm"].unique().sort().to_list() == ["sarsa-lambda", "tsarsa-lambda"]
    assert study.export(folder) == folder / "export.csv"
    assert pl.read_csv(folder / "export.csv").equals(
        frame.cast({"run": pl.Int64, "agent": pl.Int64, "episode": pl.Int64})
    )
    with pytest.raises(UnknownNameError, match="unknown format 'xlsx': use one of csv, parquet"):
        study.export(folder, form="xlsx")
    with pytest.raises(ParameterError, match=r"the file must end in \.csv or \.parquet"):
        study.export(folder, tmp_path / "runs.txt")


def test_very_large_studies_are_refused_unless_that_is_meant(folder: Path, tmp_path: Path) -> None:
    many = changed(("runs = 3", "runs = 4_000_000"))
    with pytest.raises(
        ParameterError, match="study file asks for 12,000,000 runs: 3 variants on 1 problem: pass most_runs=12000000"
    ):
        tuckerl.Study.from_text(many)
    (tmp_path / "many.toml").write_text(many)
    assert tuckerl.Study.from_file(tmp_path / "many.toml", most_runs=12_000_000).n_runs == 16_000_000
    with pytest.raises(ParameterTypeError, match="most_runs must be a whole number of at least 0; got '1' of type str"):
        tuckerl.Study.from_text(LAKE, most_runs="1")  # type: ignore[arg-type]  # wrong on purpose


def test_a_folder_without_a_study_is_said(tmp_path: Path) -> None:
    study = tuckerl.Study.from_text(LAKE)
    for call in (study.report, study.export, tuckerl.Study.from_folder):
        with pytest.raises(ParameterError, match=r"holds no study\.toml, .*: `tuckerl study run FILE --out"):
            call(tmp_path)
        with pytest.raises(ParameterError, match="is no folder"):
            call(tmp_path / "none")
        with pytest.raises(ParameterError, match=r"cannot look into 'a+.*: File name too long"):
            call("a" * 5000)
    assert study.status("a" * 5000).n_finished == 0


_OWN = """\
import gymnasium

class Own(gymnasium.Env):
    observation_space = gymnasium.spaces.Discrete(2)
    action_space = gymnasium.spaces.Discrete(2)

    def reset(self, *, seed=None, options=None):
        return 0, {}

    def step(self, action):
        return 1, float(action), True, False, {}

gymnasium.register("OwnOfAStudy-v0", entry_point="own_of_a_study:Own")
"""


def test_an_edit_of_a_users_own_environment_is_another_code(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "own_of_a_study.py"
    file.write_text(_OWN)
    monkeypatch.syspath_prepend(tmp_path)
    study = tuckerl.Study.from_text(
        "runs = 2\nepisodes = 2\n[[problem]]\nenv = 'own_of_a_study:OwnOfAStudy-v0'\n"
        "[[algorithm]]\nalgorithm = 'q-learning'"
    )
    folder = tmp_path / "results"
    study.run(folder, workers=1)
    file.write_text(_OWN.replace("float(action)", "2.0 * action"))
    _digest.cache_clear()  # as in another process
    assert study.status(folder).n_of_other_code == 2
    with pytest.raises(
        OutputConflictError, match=r"changed code of own_of_a_study\.py\): keep them with --accept-code"
    ):
        study.run(folder, workers=1)
    assert study.run(folder, workers=1, accept_code=True).runs.height == 4
    assert study.status(folder).n_finished == 2
    _digest.cache_clear()


def test_progress_is_shown_on_a_terminal_only(folder: Path) -> None:
    said = io.StringIO()
    with redirect_stderr(said):
        tuckerl.Study.from_folder(folder).run(folder, workers=1, progress=True)
    assert said.getvalue() == ""
