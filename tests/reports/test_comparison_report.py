import json
import re
import shlex
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.reports.test_report import LOADING, Page
from tests.studies.comparisons import config_of, small_comparison, tables_of
from tuckerl.cli.settings import parse_settings
from tuckerl.errors import OutputError
from tuckerl.reports import text as wording
from tuckerl.reports.comparison_page import command, outcome, write_comparison
from tuckerl.reports.curves import COMPARISON
from tuckerl.studies.comparison_result import ComparisonResult, summarise_comparison
from tuckerl.studies.statistics import Difference

N = 4  # episodes


def result(
    base: list[float], candidate: list[float], control: list[float], n_agents: int = 2, **changes: Any
) -> ComparisonResult:
    """Return a comparison in which run r of each variant returns the r-th number in every episode."""
    made = small_comparison(n_agents=n_agents, n_runs=len(base), n_episodes=N, **changes)
    names = [variant.name for variant in made.scenario.variants]
    returns = {
        name: [[value] * N for value in own] for name, own in zip(names, (base, candidate, control), strict=True)
    }
    return summarise_comparison(made, tables_of(made, returns))


BETTER = ([-10.0, -12.0, -20.0], [-5.0, -6.0, -11.0], [-10.0, -11.0, -18.0])


@pytest.fixture(scope="module")
def better() -> ComparisonResult:
    return result(*BETTER)


@pytest.fixture(scope="module")
def folder(better: ComparisonResult, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("compare") / "results"
    assert write_comparison(better, folder) == folder / "report.html"
    return folder


@pytest.fixture(scope="module")
def source(folder: Path) -> str:
    return (folder / "report.html").read_text(encoding="utf-8")


def test_everything_is_written(folder: Path, better: ComparisonResult) -> None:
    assert sorted(path.name for path in folder.iterdir()) == ["compare.json", "figures", "report.html"]
    assert sorted(path.name for path in (folder / "figures").iterdir()) == ["compare.png", "compare.svg"]
    assert json.loads((folder / "compare.json").read_text()) == json.loads(json.dumps(better.to_dict()))


def test_writing_again_gives_the_same_bytes(folder: Path, better: ComparisonResult, tmp_path: Path) -> None:
    write_comparison(better, tmp_path)
    for path in folder.rglob("*.*"):
        assert (tmp_path / path.relative_to(folder)).read_bytes() == path.read_bytes(), path.name


def test_a_folder_that_cannot_be_made_is_said(better: ComparisonResult, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="cannot make the folder"):
        write_comparison(better, tmp_path / "file")


def test_the_page_loads_nothing(source: str) -> None:
    page = Page(source)
    for tag, attributes in page.tags:
        for name in LOADING & attributes.keys():
            assert (attributes[name] or "").startswith(("#", "data:")), (tag, name)
    assert page.all("link") == page.all("img") == []
    (policy,) = [m["content"] for m in page.all("meta") if m.get("http-equiv") == "Content-Security-Policy"]
    assert (policy or "").startswith("default-src 'none';")
    ids = [attributes["id"] for _, attributes in page.tags if "id" in attributes]
    assert len(ids) == len(set(ids))


def test_the_page_shows_both_differences_and_every_variant(source: str, better: ComparisonResult) -> None:
    cells = [re.sub(r"\s+", " ", text).strip() for text in Page(source).texts]
    assert wording.amount(better.difference) in cells
    assert wording.amount(better.control) in cells
    for variant in better.study.scenario.variants:
        assert variant.name in cells
    assert command(better.study.config) in cells
    assert outcome(better) in cells


def test_the_page_escapes_what_users_name(better: ComparisonResult, tmp_path: Path) -> None:
    scenario = better.study.scenario
    assert "<" not in scenario.name
    study = replace(better.study.study, scenarios=(replace(scenario, title="<s>alert()", name="<b>"),))
    named = better._replace(study=better.study._replace(study=study))
    page = write_comparison(named, tmp_path).read_text(encoding="utf-8")
    assert "<s>" not in page
    assert "<b>" not in page


def test_the_figure_shows_courses_above_and_gains_below(better: ComparisonResult) -> None:
    upper, lower = COMPARISON.draw(better).axes
    drawn = [np.asarray(line.get_ydata()).tolist() for line in upper.lines[:3]]
    assert drawn == [curve.band.mean.tolist() for curve in better.curves]
    assert np.asarray(lower.lines[0].get_ydata()) == pytest.approx([(5 + 6 + 9) / 3] * N)
    assert upper.get_ylabel() == "return of an episode"
    assert lower.get_ylabel() == "better than sarsa-lambda by (return)"
    names = sorted(curve.variant for curve in better.curves)
    for axes in (upper, lower):
        assert sorted(text.get_text() for text in axes.texts) == names


def test_fewer_steps_are_drawn_as_a_gain() -> None:
    steps = result(*BETTER, measure="steps")
    upper, lower = COMPARISON.draw(steps).axes
    assert np.asarray(upper.lines[0].get_ydata()) == pytest.approx([14] * N)
    assert np.asarray(lower.lines[0].get_ydata()) == pytest.approx([20 / 3] * N)
    assert lower.get_ylabel() == "better than sarsa-lambda by (steps)"
    assert "steps of an episode" in COMPARISON.caption(steps)


def test_the_caption_says_what_is_left_out() -> None:
    made = small_comparison("sarsa", "q-learning", n_runs=2, n_episodes=2)
    lost = summarise_comparison(
        made, tables_of(made, {"sarsa": [[-1, -2], [-2, -2]], "q-learning": [[-1, None], [-1, -1]]})
    )
    caption = COMPARISON.caption(lost)
    assert "Left out because they diverged: 1 run" in caption
    assert "control" not in caption
    one = small_comparison("sarsa", "q-learning", n_runs=1, n_episodes=250)
    single = summarise_comparison(one, tables_of(one, {"sarsa": [[-1.0] * 250], "q-learning": [[-2.0] * 250]}))
    assert "One run has no interval." in COMPARISON.caption(single)
    assert "Each point is the mean of 3 episodes (the last, of what is left)." in COMPARISON.caption(single)


def test_a_gain_beyond_the_control_is_said(better: ComparisonResult) -> None:
    words = outcome(better)
    assert words.startswith("tsarsa-lambda-2 does better than sarsa-lambda: mean return of an episode ")
    assert "does better than the control, constant-2-min" in words
    told = (
        "So what the control has too, the smaller learning rate and the sharing among its agents, does not explain all "
        "of the gain over the base."
    )
    assert told in words


def test_a_gain_that_the_control_has_too_is_said() -> None:
    base, candidate, _ = BETTER
    same = result(base, candidate, [-6.0, -5.0, -11.0])
    assert "neither better nor worse than the control" in outcome(same)
    assert "explains the gain over the base, as far as these runs can tell." in outcome(same)
    lessened = result(base, candidate, [-2.0, -3.0, -4.0])
    assert "does worse than the control" in outcome(lessened)
    assert "with equal weights for all actions it is larger." in outcome(lessened)


def test_what_is_not_decided_is_said() -> None:
    words = outcome(result([-10.0, -12.0], [-12.0, -10.0], [-10.0, -11.0]))
    assert words.startswith("These runs do not decide between tsarsa-lambda-2 and sarsa-lambda: ")
    assert "the interval covers 0" in words
    assert words == words.strip()
    one = outcome(result([-10.0], [-12.0], [-10.0]))
    assert "over 1 pair; one pair has no interval." in one
    assert "There are too few pairs to compare it with the control, constant-2-min." in one


def test_a_loss_is_said() -> None:
    words = outcome(result([-5.0, -6.0, -7.0], [-10.0, -11.0, -12.0], [-10.0, -11.0, -13.0]))
    assert words.startswith("tsarsa-lambda-2 does worse than sarsa-lambda")
    assert "So " not in words


def test_the_reason_for_no_control_and_lost_pairs_are_said() -> None:
    made = small_comparison("sarsa", "q-learning", n_runs=2, n_episodes=1)
    told = outcome(summarise_comparison(made, tables_of(made, {"sarsa": [[-2], [-4]], "q-learning": [[-1], [-2]]})))
    assert told.endswith(
        "No control was played: neither of the two has a tensor step whose smaller learning rate would have to be "
        "controlled for."
    )
    lost = summarise_comparison(made, tables_of(made, {"sarsa": [[-2], [-4]], "q-learning": [[None], [None]]}))
    assert outcome(lost) == "Nothing is left to compare: in all 2 pairs a run diverged."


def test_the_control_of_the_base_is_said_to_be_so() -> None:
    made = small_comparison("tq-learning", "sarsa", n_runs=2, n_episodes=1)
    names = [variant.name for variant in made.scenario.variants]
    values: list[list[list[float | None]]] = [[[-2], [-4]], [[-1], [-2]], [[-3], [-5]]]
    told = outcome(summarise_comparison(made, tables_of(made, dict(zip(names, values, strict=True)))))
    assert told.endswith("That control is the base's own: it shows how far the base's weights matter.")


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (1234.5, "1,234"),
        (-123.45, "\N{MINUS SIGN}123.5"),
        (12.345, "12.35"),
        (0.1234, "0.1234"),
        (2e-5, "2.00e\N{MINUS SIGN}05"),
    ],
)
def test_numbers_of_any_size_have_about_four_figures(value: float, text: str) -> None:
    assert wording.measured(value) == text


def test_absolute_differences_have_no_percent() -> None:
    absolute = Difference(0.5, 0.25, 0.75, 3, 0, relative=False)
    assert (wording.amount(absolute), wording.amount_interval(absolute)) == ("+0.5000", "[0.2500, 0.7500]")
    relative = Difference(0.5, 0.25, 0.75, 3, 0)
    assert (wording.amount(relative), wording.amount_interval(relative)) == ("+50.0 %", "[25.0, 75.0]")


def test_the_command_says_all_that_is_not_the_default_and_is_read_as_it_was() -> None:
    settings = {"alpha": 0.2, "candidate.ranks": (5, 3, 9, 1), "base.ties": "first", "cut_traces": False}
    keywords = {"map_name": "8x8", "is_slippery": False, "label": "true"}
    made = config_of(settings=settings, keywords=keywords, n_agents=3, measure="steps", n_episodes=500)
    line = command(made)
    assert line.startswith("tuckerl compare sarsa-lambda tsarsa-lambda --env tuckerl/DynaMaze-v0 --env-set ")
    assert line.endswith("--runs 2 --agents 3 --measure steps --seed 3")
    assert "--set base.ties=first " in line
    parts = shlex.split(line)
    given = {
        option: [parts[i + 1] for i, part in enumerate(parts) if part == option] for option in ("--set", "--env-set")
    }
    assert parse_settings(given["--set"]) == settings
    assert parse_settings(given["--env-set"]) == keywords
