"""A comparison of more agents with fewer can hold their experience equal: the episodes of all agents together."""

from pathlib import Path

import numpy as np
import polars as pl
import pytest

from tests.studies.comparisons import small_comparison
from tuckerl.errors import ParameterError
from tuckerl.reports.comparison_page import command, outcome, write_comparison
from tuckerl.studies.comparison_result import summarise_comparison
from tuckerl.studies.reproduce import run_study
from tuckerl.studies.runs import run_identities


def test_agents_share_the_episodes_and_the_result_says_so(tmp_path: Path) -> None:
    made = small_comparison(n_agents=3, n_episodes=21, n_runs=1, equal_experience=True)
    tables = run_study(made.study, tmp_path, workers=1)
    counts = tables.runs.group_by("variant").agg(pl.len(), pl.col("agent").n_unique(), pl.col("episode").n_unique())
    assert sorted(counts.rows()) == [
        ("constant-3-min", 21, 3, 7),
        ("sarsa-lambda", 21, 1, 21),
        ("tsarsa-lambda-3", 21, 3, 7),
    ]
    result = summarise_comparison(made, tables)
    assert "Both play 21 episodes in all: tsarsa-lambda-3 has 3 agents, each of which plays 7 of them." in outcome(
        result
    )
    assert "--equal-experience" in command(made.config)
    assert result.to_dict()["equal_experience"] is True
    candidate = tables.runs.filter(variant="tsarsa-lambda-3").group_by("episode").agg(pl.col("return").mean())
    drawn = np.repeat(candidate.sort("episode")["return"].to_numpy(), 3)  # an episode of three agents counts as three
    assert result.curves[1].band.mean == pytest.approx(drawn)
    assert result.episode[-1] == 21
    assert "The axis counts the episodes of all agents together." in write_comparison(result, tmp_path).read_text()


def test_only_the_variants_of_several_agents_are_other_runs() -> None:
    made, apart = (
        small_comparison(n_agents=3, n_episodes=21, n_runs=1, equal_experience=equal) for equal in (True, False)
    )
    own, other = run_identities(made.study), run_identities(apart.study)
    assert {run.variant: own[run] == other[run] for run in own} == {
        "sarsa-lambda": True,
        "tsarsa-lambda-3": False,
        "constant-3-min": False,
    }


def test_without_it_the_result_says_who_plays_more(tmp_path: Path) -> None:
    made = small_comparison(n_agents=3, n_episodes=21, n_runs=1)
    words = outcome(summarise_comparison(made, run_study(made.study, tmp_path, workers=1)))
    assert "tsarsa-lambda-3 plays three times the episodes of sarsa-lambda: 3 agents with 21 each." in words
    assert "--equal-experience" not in command(made.config)


def test_episodes_that_cannot_be_shared_are_refused_with_some_that_can() -> None:
    with pytest.raises(ParameterError, match="multiple of the 3 agents that share them; got 20: give --episodes 21"):
        small_comparison(n_agents=3, n_episodes=20, equal_experience=True)
