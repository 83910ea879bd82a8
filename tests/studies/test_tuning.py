import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest

from tuckerl.errors import MissingExtraError, OutputConflictError, ParameterError, ProblemError, TuckerlError
from tuckerl.reports.tuning_page import command, outcome, write_tuning
from tuckerl.studies import reproduce
from tuckerl.studies.algorithms import ALGORITHMS
from tuckerl.studies.run_progress import RunProgress
from tuckerl.studies.runs import Run, run_code, run_identities
from tuckerl.studies.search_space import DEFAULT_RANGES, Choices, Range, Searched, SearchSpace
from tuckerl.studies.statistics import Pairs
from tuckerl.studies.store import Results
from tuckerl.studies.study import Scenario, Study, Variant
from tuckerl.studies.tuning import Search, Tuning, TuningConfig
from tuckerl.studies.tuning_folder import TuningResult, play_tuning
from tuckerl.studies.variants import NamedEnvironment

SMALL = TuningConfig(
    "tq-learning",
    "FrozenLake-v1",
    keywords={"is_slippery": False},
    searched={"alpha": Range(0.1, 0.9)},
    settings={"initial_q": 1.0},
    n_trials=7,
    batch=4,
    rungs=(1, 2, 3),
    n_runs=3,
    n_episodes=20,
    seed=5,
)


def tuned(folder: Path, config: TuningConfig = SMALL, **options: Any) -> TuningResult:
    result = play_tuning(Tuning(config), folder, **{"workers": 1, **options})
    write_tuning(result, folder)
    return result


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, TuningResult]:
    folder = tmp_path_factory.mktemp("tuned")
    return folder, tuned(folder)


def files_of(folder: Path) -> dict[str, bytes]:
    return {name: (folder / name).read_bytes() for name in ("tune.json", "runs.parquet", "study.json")}


def test_a_batch_is_halved_in_rungs_and_the_best_of_the_last_wins(small: tuple[Path, TuningResult]) -> None:
    _, result = small
    for search in result.tuned.searches:
        assert [trial.batch for trial in search.trials] == [0, 0, 0, 0, 1, 1, 1]
        for batch, sizes in enumerate(([4, 2, 1], [3, 1, 1])):
            own = [trial for trial in search.trials if trial.batch == batch]
            assert [sum(rung in trial.means for trial in own) for rung in SMALL.rungs] == sizes
            for rung, following in ((1, 2), (2, 3)):
                played = [trial for trial in own if rung in trial.means]
                stays = [trial.means[rung] for trial in played if following in trial.means]
                leaves = [trial.means[rung] for trial in played if following not in trial.means]
                assert min(stays) >= max(leaves, default=-1)
        last = [trial.means[3] for trial in search.trials if 3 in trial.means]
        assert search.winner().means[3] == max(last)


def test_means_are_those_of_the_runs_and_later_rungs_have_the_runs_of_earlier_ones(
    small: tuple[Path, TuningResult],
) -> None:
    folder, result = small
    runs = pl.read_parquet(folder / "runs.parquet")
    for search in result.tuned.searches:
        for trial in search.trials:
            for rung, mean in trial.means.items():
                scenario = f"FrozenLake-v1(is_slippery=False): tuning, runs: {rung}"
                own = runs.filter(scenario=scenario, variant=trial.name)
                assert own["run"].n_unique() == rung
                assert own.group_by("run").agg(pl.col("return").mean())["return"].mean() == pytest.approx(mean)
    identities = run_identities(result.tuned.study)
    winner = result.tuned.searches[0].winner().name
    of_each = [f"FrozenLake-v1(is_slippery=False): tuning, runs: {rung}" for rung in SMALL.rungs]
    assert len({identities[Run(name, winner, 0, 0)] for name in of_each}) == 1


def test_the_test_has_other_seeds_and_the_tuned_base_and_the_control(small: tuple[Path, TuningResult]) -> None:
    _, result = small
    test, (first, second) = result.tuned.test, result.tuned.searches
    base, candidate, control = test.variants
    assert (base.name, candidate.name) == (second.winner().name, first.winner().name)
    assert base.name.startswith("q-learning[alpha=")
    assert (control.name, control.n_agents) == (f"{candidate.name}-constant", candidate.n_agents)
    assert control.tensor_step is not None
    assert control.tensor_step.weights == "constant"
    assert [len(search.trials) for search in (first, second)] == [7, 7]
    assert {*second.space.searched} == {"alpha", "epsilon"} <= {*first.space.searched}
    assert base.parameters["initial_q"] == candidate.parameters["initial_q"] == 1.0
    study = result.tuned.study
    numbers = {scenario.number for scenario in study.scenarios[:-1]}
    assert len(numbers) == 1
    assert test.number not in numbers
    assert study.run_seed(test, 0, 0).generate_state(1) != study.run_seed(study.scenarios[0], 0, 0).generate_state(1)
    assert result.compared.difference.n_pairs == 3


def test_settings_differ_between_batches_and_with_the_seed(small: tuple[Path, TuningResult]) -> None:
    _, result = small
    names = [trial.name for trial in result.tuned.searches[0].trials]
    assert len(set(names)) == 7
    asked = Tuning(SMALL).search  # the same proposals again, before anything is played
    first: list[str] = []

    def only_look(study: Study) -> Any:
        first.extend(variant.name for variant in study.scenarios[0].variants)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        asked(only_look)
    assert first[:4] == names[:4]
    first.clear()
    with pytest.raises(KeyboardInterrupt):
        Tuning(SMALL._replace(seed=6)).search(only_look)
    assert not {*first} & {*names}


@pytest.mark.slow
def test_an_interrupt_anywhere_changes_nothing(
    small: tuple[Path, TuningResult], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(reproduce, "_SECONDS_BETWEEN_WRITES", 0.0)
    monkeypatch.setattr(reproduce, "_WRITES_SHARE", 1.0)
    played: list[int] = []

    def stop_in(part: int) -> Any:
        begun: list[int] = []

        def progress(runs: RunProgress) -> None:
            if runs.n_total not in begun:
                begun.append(runs.n_total)
            elif len(begun) == part:  # one of its runs is finished
                raise KeyboardInterrupt

        return progress

    for part in (1, 3, 2, 4):  # ever further, and each goes on from the one before
        with pytest.raises(KeyboardInterrupt):
            tuned(tmp_path, progress=stop_in(part))
        held = json.loads((tmp_path / "study.json").read_text())["scenarios"]
        played.append(sum(len(one["variants"]) for one in held.values()))
    assert played == [8, 14, 20, 27]  # in the first rung, the last, the next batch, and the test
    tuned(tmp_path)
    assert files_of(tmp_path) == files_of(small[0])


@pytest.mark.slow
@pytest.mark.compiled  # workers load kernels
def test_two_workers_find_what_one_does(tmp_path: Path) -> None:
    config = SMALL._replace(n_trials=3, batch=3, rungs=(2, 3))
    for workers in (1, 2):
        tuned(tmp_path / str(workers), config, workers=workers)
    assert files_of(tmp_path / "2") == files_of(tmp_path / "1")


def test_nothing_is_played_twice(small: tuple[Path, TuningResult], monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> Any:
        raise AssertionError("everything is finished")

    folder, before = small[0], files_of(small[0])
    monkeypatch.setattr("tuckerl.studies.workers.play_run", refuse)
    tuned(folder)
    assert files_of(folder) == before
    parts = sum(len(stored) for stored in Results(folder, small[1].tuned.study)._parts.stored.values())
    assert parts == len(set(run_identities(small[1].tuned.study).values()))


def test_what_other_code_played_is_kept_only_where_that_is_said(
    small: tuple[Path, TuningResult], monkeypatch: pytest.MonkeyPatch
) -> None:
    def changed_code(scenario: Scenario, variant: Variant) -> dict[str, str]:
        return {**run_code(scenario, variant), "tuckerl.learners.q_learning": "changed"}

    folder, before = small[0], files_of(small[0])
    monkeypatch.setattr("tuckerl.studies.store.run_code", changed_code)
    with pytest.raises(OutputConflictError, match="runs as other code has played them"):
        tuned(folder)
    tuned(folder, accept_code=True)
    assert {**files_of(folder), "study.json": b""} == {**before, "study.json": b""}


def test_words_numbers_and_the_command(small: tuple[Path, TuningResult]) -> None:
    folder, result = small
    first, second = (search.winner().name for search in result.tuned.searches)
    words = outcome(result)
    assert words.startswith(
        f"Of 7 trials of tq-learning, {first} was best; of 7 trials of q-learning, {second} was best."
    )
    assert "control" in words
    written = json.loads((folder / "tune.json").read_text())
    assert [search["winner"] for search in written["searches"]] == [first, second]
    assert written["searches"][0]["searched"]["alpha"] == "0.1:0.9"
    assert (written["test"]["runs"], written["test"]["control"]) == (3, f"{first}-constant")
    assert command(SMALL) == (
        "tuckerl tune tq-learning FrozenLake-v1 --env-set is_slippery=False --set initial_q=1.0 --search alpha=0.1:0.9 "
        "--trials 7 --batch 4 --runs 3 --episodes 20 --rungs 1,2,3 --seed 5"
    )
    page = (folder / "report.html").read_text()
    assert "The search for q-learning" in page
    assert "tuned with the same budget" in page


def test_an_algorithm_without_a_tensor_step_is_tested_beside_itself_by_default(tmp_path: Path) -> None:
    config = SMALL._replace(algorithm="q-learning", n_trials=2, batch=2, rungs=(1,), n_runs=2)
    result = tuned(tmp_path, config)
    assert [variant.name for variant in result.tuned.test.variants] == [
        "q-learning-default",
        result.tuned.searches[0].winner().name,
    ]
    assert result.compared.no_control.startswith("neither of the two has a tensor step")


def test_trials_that_diverge_are_stopped_and_if_all_do_it_is_said(tmp_path: Path) -> None:
    config = SMALL._replace(
        algorithm="q-learning",
        settings={"initial_q": 1e308, "gamma": 1.0, "epsilon": 0.1},
        keywords={"is_slippery": False, "reward_schedule": (1e308, 1e308, 1e308)},
        n_trials=2,
        batch=2,
        rungs=(1, 2),
    )
    with pytest.raises(ParameterError, match="all trials of q-learning diverged: search smaller learning rates"):
        tuned(tmp_path, config)


def test_one_diverged_run_stops_a_trial_however_well_it_did_before() -> None:
    (space,) = Tuning(SMALL._replace(algorithm="q-learning")).spaces
    search = Search(space, SMALL)
    trials = search.ask(0)
    found = ((9.0, True), (1.0, False), (3.0, False), (2.0, False))
    pairs = {
        trial.name: Pairs(np.arange(2), np.array([mean, mean]), np.array([False, diverged]))
        for trial, (mean, diverged) in zip(trials, found, strict=True)
    }
    going = search.judge(trials, 2, pairs)
    assert going == [trials[2], trials[3]]
    assert search.judge([trials[0]], 2, pairs) == []
    search.judge(going, 3, pairs)
    search.tell(trials)
    assert search.winner() is trials[2]


def test_of_steps_fewer_are_better() -> None:
    config = SMALL._replace(algorithm="q-learning", measure="steps")
    search = Search(Tuning(config).spaces[0], config)
    trials = search.ask(0)
    pairs = {
        trial.name: Pairs(np.arange(1), np.array([steps]), np.array([False]))
        for trial, steps in zip(trials, (9.0, 4.0, 4.0, 8.0), strict=True)
    }
    assert search.judge(trials, 3, pairs) == [trials[1], trials[2]]
    search.tell(trials)
    assert search.winner() is trials[1]  # the first of those that are equal


def test_a_run_that_fails_ends_the_tuning_with_where_its_traceback_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> Any:
        raise RuntimeError("broken")

    monkeypatch.setattr("tuckerl.studies.workers.play_run", fail)
    config = SMALL._replace(algorithm="q-learning", n_trials=1)
    with pytest.warns(match="ended with an error"), pytest.raises(ProblemError, match=r"tracebacks are in .*failures"):
        tuned(tmp_path, config)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"algorithm": "tq-lerning"}, "did you mean 'tq-learning'"),
        ({"environment": "FrozenLake-v7"}, "FrozenLake"),
        ({"measure": "speed"}, "measure"),
        ({"searched": {"alhpa": Range(0.1, 1)}}, "did you mean 'alpha'"),
        ({"settings": {"alhpa": 0.1}}, "did you mean 'alpha'"),
        ({"settings": {"alpha": 0.1}}, "alpha is both set and searched"),
        ({"settings": {"agents": 2}}, "fix the number with --agents"),
        (
            {"searched": {"alpha": Range(0.5, 0.1)}},
            "alpha must be searched from a low to a higher number; got 0.5 to 0.1",
        ),
        ({"searched": {"alpha": Range(0.5, 0.5)}}, "alpha must be searched from a low to a higher number"),
        ({"searched": {"alpha": Range(0.0, 0.5, log=True)}}, "alpha must be above 0 where ratios are searched"),
        ({"searched": {"alpha": Range(0.1, 2.0)}}, "alpha must be a number in"),
        ({"searched": {"alpha": Choices(())}}, "alpha has no value to try"),
        ({"searched": {"alpha": Choices((0.1, "fast"))}}, "alpha"),
        ({"searched": {"every": Range(2.5, 9)}}, "low end of every must be a whole number"),
        ({"searched": {"ties": Range(1, 2)}}, "ties is no number, so it has no range"),
        ({"searched": {"state_rank": Range(1, 3)}, "settings": {"ranks": (2, 2, 2, 1)}}, "ranks and state_rank"),
        ({"algorithm": "q-learning", "searched": {"every": Range(2, 9)}}, "every belongs to the tensor step"),
        ({"algorithm": "q-learning", "searched": {"agents": Range(1, 3)}}, "agents is searched of algorithms with a"),
        ({"algorithm": "q-learning", "n_agents": 2}, "leave --agents out"),
        ({"algorithm": "q-learning", "searched": {}, "settings": {"alpha": 0.1, "epsilon": 0.1}}, "leave something to"),
        ({"n_trials": 0}, "trials must be a whole number of at least 1"),
        ({"batch": 0}, "batch must be"),
        ({"n_runs": 0}, "runs must be"),
        ({"n_episodes": 0}, "episodes must be"),
        ({"rungs": (2, 2)}, "rungs must be numbers of runs, each larger"),
        ({"rungs": (0, 2)}, "rungs must be a whole number of at least 1"),
        ({"environment": "CartPole-v1", "keywords": {}}, "--set bins="),
    ],
)
def test_wrong_input_is_named_before_anything_is_played(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(TuckerlError, match=message):
        Tuning(SMALL._replace(**changes))


def test_without_optuna_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "optuna", None)
    with pytest.raises(MissingExtraError, match=r'pip install "tuckerl\[tune\]"'):
        Tuning(SMALL)


@pytest.mark.parametrize("name", ["r-max", "n-step-sarsa", "t-dyna-q", "tsarsa-lambda"])
def test_default_ranges_are_those_that_an_algorithm_has(name: str) -> None:
    environment = NamedEnvironment("FrozenLake-v1", {})
    space = SearchSpace(ALGORITHMS[name], environment, {}, {}, None, 30)
    own = {"r-max": {"m", "planning_steps"}, "n-step-sarsa": {"n"}, "t-dyna-q": {"planning_steps"}}
    assert own.get(name, {"lambda_"}) & {*space.searched} <= {*space.searched} <= {*DEFAULT_RANGES}
    if ALGORITHMS[name].is_t_version:
        assert space.searched["every"] == Range(2, 30, log=True)  # no window is longer than a run
        assert space.searched["action_rank"] == Range(1, 3)
        ranked = space.variant({"state_rank": 4, "action_rank": 2, "agents": 3}).variant
        assert ranked.tensor_step is not None
        assert (ranked.tensor_step.ranks, ranked.n_agents) == ((4, 2, 9, 1), 3)


def test_ranks_by_energy_can_be_fixed_and_searched() -> None:
    environment = NamedEnvironment("FrozenLake-v1", {})
    fixed = SearchSpace(ALGORITHMS["tq-learning"], environment, {}, {"ranks": "auto"}, None, 30)
    assert not {"state_rank", "action_rank", "ranks"} & {*fixed.searched}
    searched: dict[str, Searched] = {"ranks": Range(0.8, 0.99)}
    space = SearchSpace(ALGORITHMS["tq-learning"], environment, searched, {}, None, 30)
    assert {"state_rank", "action_rank", "ranks"} & {*space.searched} == {"ranks"}
    chosen = space.variant({"ranks": 0.9})
    assert (chosen.variant.name, chosen.algorithm.step.ranks) == ("tq-learning[ranks=0.9]", 0.9)
    with pytest.raises(ParameterError, match=r"must be a number in \(0, 1\]; got 2.0"):
        SearchSpace(ALGORITHMS["tq-learning"], environment, {"ranks": Range(0.5, 2)}, {}, None, 30)


def test_fixed_agents_policies_and_ranks_are_not_searched() -> None:
    environment = NamedEnvironment("FrozenLake-v1", {})
    from tuckerl import Softmax

    settings = {"policy": Softmax(0.5), "ranks": (3, 2, 2, 1)}
    space = SearchSpace(ALGORITHMS["tq-learning"], environment, {}, settings, 2, 30)
    assert {*space.searched} == {"alpha", "every"}
    assert space.variant({}).variant.n_agents == 2
