import json
import pickle
from dataclasses import replace
from functools import partial
from pathlib import Path

import gymnasium
import numpy as np
import pytest

import tuckerl
from tests.studies.comparisons import MAZE, SMALL, config_of, small_comparison
from tuckerl.adapters.making import make_environment
from tuckerl.adapters.resolve import AdapterOptions, Agents, as_problem
from tuckerl.errors import (
    OutputConflictError,
    ParameterError,
    ParameterTypeError,
    ProblemError,
    SpaceError,
    UnknownNameError,
)
from tuckerl.generalization.tensor_step import TensorStep
from tuckerl.reports.comparison_text import regrets_of
from tuckerl.studies import playing
from tuckerl.studies.comparison import ComparisonConfig, comparison_study
from tuckerl.studies.comparison_result import summarise_comparison
from tuckerl.studies.environments import environment_specification, listed_environments
from tuckerl.studies.reproduce import run_study
from tuckerl.studies.run_progress import RunProgress
from tuckerl.studies.runs import run_code
from tuckerl.studies.store import Store

FILES = ("runs.parquet", "weights.parquet", "paths.parquet")


def names(base: str, candidate: str, **changes: object) -> list[str]:
    return [made.name for made in small_comparison(base, candidate, **changes).scenario.variants]


def test_base_candidate_and_control_play() -> None:
    made = small_comparison(n_agents=3)
    base, candidate, control = made.scenario.variants
    assert [base.name, candidate.name, control.name] == ["sarsa-lambda", "tsarsa-lambda-3", "constant-3-min"]
    assert (base.tensor_step, base.n_agents) == (None, 1)
    assert candidate.tensor_step == TensorStep(10, (15, 3, 9, 1), "paper", "min")
    assert control.tensor_step == TensorStep(10, (15, 3, 9, 1), "constant", "min")
    assert (control.learner, control.parameters, control.n_agents) == (candidate.learner, candidate.parameters, 3)
    assert (made.comparison.base, made.comparison.candidate, made.comparison.control) == (
        base.name,
        candidate.name,
        control.name,
    )


def test_the_control_is_that_of_the_t_version_wherever_it_stands() -> None:
    assert names("tq-learning", "sarsa") == ["tq-learning-1", "sarsa", "constant-1"]
    assert small_comparison("tq-learning", "sarsa").scenario.variants[2].learner is tuckerl.QLearning
    both = small_comparison("tq-learning", "dyna-ht", n_agents=2)
    assert [made.name for made in both.scenario.variants] == ["tq-learning-2", "dyna-ht-2", "constant-2-max"]
    assert both.scenario.variants[2].learner is tuckerl.DynaH


def test_where_there_is_no_control_the_reason_is_given() -> None:
    plain = small_comparison("sarsa", "q-learning")
    assert plain.comparison.control == ""
    assert plain.no_control.startswith("neither of the two has a tensor step")
    own = small_comparison("sarsa", "tq-learning", settings={"weights": "constant"})
    assert own.no_control == "the weights of tq-learning-1 are constant: it is its own control"
    assert len(own.scenario.variants) == 2


def test_settings_go_to_both_or_to_one_side() -> None:
    settings = {"alpha": 0.3, "lambda_": 0.5, "every": 5, "candidate.gamma": 0.9, "base.alpha": 0.4, "share": "mean"}
    base, candidate, control = small_comparison("q-learning", "tsarsa-lambda", settings=settings).scenario.variants
    assert base.parameters == {"alpha": 0.4}  # lambda_ and every are none of its parameters
    assert candidate.parameters == control.parameters == {"alpha": 0.3, "lambda_": 0.5, "gamma": 0.9}
    assert candidate.tensor_step == TensorStep(5, (15, 3, 9, 1), "paper", "mean")
    assert (candidate.name, control.name) == ("tsarsa-lambda-1-mean", "constant-1")


def test_one_algorithm_can_be_compared_with_itself_under_other_settings() -> None:
    assert names("sarsa", "sarsa", settings={"candidate.alpha": 0.5}) == ["sarsa", "sarsa-candidate"]


def test_a_run_is_what_the_learner_alone_does(tmp_path: Path) -> None:
    made = small_comparison(n_agents=2)
    runs = run_study(made.study, tmp_path, workers=1).runs
    env = make_environment(MAZE, SMALL)
    for r in range(2):
        step = TensorStep(10, (15, 3, 9, 1), share="min")
        seed = np.random.SeedSequence(3, spawn_key=(3, 0, r))
        alone = tuckerl.SarsaLambda(env, n_agents=2, tensor_step=step, seed=seed).learn(episodes=20)
        own = runs.filter(variant="tsarsa-lambda-2", run=r).sort("agent", "episode")
        assert np.array_equal(own["return"].to_numpy().reshape(2, 20), alone.returns.T)


def test_the_regret_of_what_was_learned_is_that_of_the_learner(tmp_path: Path) -> None:
    made = small_comparison("sarsa", "q-learning")
    tables = run_study(made.study, tmp_path, workers=1)
    known = tables.times.sort("variant", "run")["regret"].to_list()
    expected = []
    for kind in (tuckerl.QLearning, tuckerl.Sarsa):  # as their names are sorted
        for r in range(2):
            seed = np.random.SeedSequence(3, spawn_key=(3, 0, r))
            learner = kind(make_environment(MAZE, SMALL), seed=seed).learn(episodes=20)
            expected.append(tuckerl.regret(learner).regret)
    assert known == expected
    result = summarise_comparison(made, tables)
    assert [one.variant for one in result.regrets] == ["sarsa", "q-learning"]
    np.testing.assert_allclose([one.mean for one in result.regrets], [np.mean(expected[2:]), np.mean(expected[:2])])
    entry = result.to_dict()["variants"][0]
    assert entry["regret"] == result.regrets[0].mean
    assert regrets_of(result.regrets).startswith("Regret of what was learned in the end, against the optimal values")
    assert "q-learning" in regrets_of(result.regrets)


def test_where_transitions_are_not_known_no_regret_is_told(tmp_path: Path) -> None:
    made = small_comparison("sarsa", "q-learning", settings={"compiled": False}, n_runs=1, n_episodes=2)
    tables = run_study(made.study, tmp_path, workers=1)
    assert tables.times["regret"].null_count() == 2
    result = summarise_comparison(made, tables)
    assert result.regrets == ()
    assert "regret" not in result.to_dict()["variants"][0]
    assert regrets_of(result.regrets) == ""


@pytest.mark.slow
def test_workers_do_not_change_a_bit(tmp_path: Path) -> None:
    made = small_comparison()
    for workers in (1, 2):
        run_study(made.study, tmp_path / str(workers), workers=workers)
    for name in FILES:
        assert (tmp_path / "1" / name).read_bytes() == (tmp_path / "2" / name).read_bytes()


def test_an_interrupt_keeps_what_is_finished_and_the_rest_follows(tmp_path: Path) -> None:
    made = small_comparison(n_runs=3)

    def interrupt(runs: RunProgress) -> None:
        if runs.n_done >= 1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_study(made.study, tmp_path / "halting", workers=1, progress=interrupt)
    with Store(tmp_path / "halting", made.study) as store:
        assert 1 <= len(store.finished()) < 6
    again = small_comparison(n_runs=3)  # another process would make it anew, too
    run_study(again.study, tmp_path / "halting", workers=1)
    run_study(made.study, tmp_path / "straight", workers=1)
    for name in FILES:
        assert (tmp_path / "halting" / name).read_bytes() == (tmp_path / "straight" / name).read_bytes()


def test_another_environment_is_another_study(tmp_path: Path) -> None:
    Store(tmp_path, small_comparison().study).close()
    other = small_comparison(keywords=SMALL | {"maze_seed": 1})
    with pytest.raises(OutputConflictError, match="maze_seed"):
        Store(tmp_path, other.study)
    held = json.loads((tmp_path / "study.json").read_text())
    (scenario,) = held["scenarios"].values()
    assert scenario["environment"]["id"] == MAZE
    assert scenario["environment"]["keywords"] == json.loads(json.dumps(SMALL))
    code = run_code(made := other.study.scenarios[0], made.variants[0])
    assert "tuckerl.environments.dyna_maze" in code, "whose edits are those of code, and make no other study"


def test_a_study_can_be_sent_to_another_process() -> None:
    made = small_comparison()
    there = pickle.loads(pickle.dumps(made.study))  # noqa: S301  # as multiprocessing does
    assert there.specification() == made.study.specification()


def test_compiled_problems_are_made_once_and_others_by_each_learner(monkeypatch: pytest.MonkeyPatch) -> None:
    scenario = small_comparison().scenario
    base, candidate, _ = scenario.variants
    assert playing._environment(scenario, base, 0) is playing._environment(scenario, candidate, 0)
    other = small_comparison().scenario
    monkeypatch.setattr(playing, "as_problem", lambda env, options: as_problem(env, replace(options, compiled=False)))
    env = playing._environment(other, base, 0)
    assert isinstance(env, partial)
    assert env().spec.id == MAZE


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        ({"base": "sarsa-lamda"}, UnknownNameError, "unknown algorithm 'sarsa-lamda': did you mean"),
        ({"candidate": "team-q"}, ProblemError, "team-q plays the joint actions of several agents, and tuckerl/DynaM"),
        ({"measure": "speed"}, UnknownNameError, "unknown measure 'speed': use one of final, return, steps"),
        ({"n_runs": 0}, ParameterError, "runs must be a whole number of at least 1"),
        ({"n_episodes": 0}, ParameterError, "episodes must be a whole number of at least 1"),
        ({"n_agents": 0}, ParameterError, "agents must be a whole number of at least 1"),
        ({"seed": -1}, ParameterError, "seed must be a whole number of at least 0"),
        ({"candidate": "sarsa", "n_agents": 2}, ParameterError, "agents are those of a T-version, and neither"),
        ({"candidate": "sarsa-lambda"}, ParameterError, "base and candidate are both sarsa-lambda and would do the sa"),
        ({"settings": {"alpha": 2}}, ParameterError, "alpha must be a number in"),
        ({"settings": {"alhpa": 0.1}}, ParameterTypeError, "no parameter 'alhpa': did you mean 'alpha'"),
        ({"settings": {"bass.alpha": 0.1}}, UnknownNameError, "unknown side 'bass' in 'bass.alpha'"),
        ({"settings": {"base.every": 5}}, ParameterError, "every belongs to the tensor step, which sarsa-lambda is"),
        ({"settings": {"ranks": (1, 2)}}, ParameterError, "ranks must be four whole numbers"),
        ({"keywords": {"rowss": 6}}, ProblemError, "cannot make tuckerl/DynaMaze-v0 with rowss=6: "),
        ({"environment": "tuckerl/DynaMase-v0"}, UnknownNameError, "did you mean 'tuckerl/DynaMaze-v0'"),
        ({"environment": "no.such.place:X-v0"}, UnknownNameError, "there is no module 'no.such.place'"),
    ],
)
def test_what_cannot_be_compared_is_said(changes: dict[str, object], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        comparison_study(config_of()._replace(**changes))  # type: ignore[arg-type]  # of a wrong type is part of it


def test_dyna_h_needs_a_heuristic() -> None:
    with pytest.raises(ProblemError, match="DynaH needs a heuristic"):
        small_comparison("dyna-h", "dyna-ht", environment="tuckerl/CartPole-v0", keywords={})


def test_teams_can_be_compared() -> None:
    made = small_comparison("team-q", "team-tq", environment="tuckerl/RobotRescue-v0", keywords={})
    assert [variant.name for variant in made.scenario.variants] == ["team-q", "team-tq-1", "constant-1"]
    step = made.scenario.variants[1].tensor_step
    assert step is not None
    assert step.ranks == (15, 10, 9, 1)


def test_an_environment_that_cannot_be_made_is_said_in_one_line() -> None:
    with pytest.raises(ProblemError, match=r"^cannot make tuckerl/DynaMaze-v0 with rowss=6: [^\n]*$"):
        make_environment(MAZE, {"rowss": 6})


def test_an_environment_is_told_by_its_keywords_and_its_code() -> None:
    make_environment("FrozenLake-v1", {"is_slippery": False}).close()
    told = environment_specification("FrozenLake-v1", {"is_slippery": False})
    assert told["keywords"] == {"is_slippery": False}
    assert told["sources"] != environment_specification(MAZE, {})["sources"]


def test_listed_environments_say_how_they_are_played() -> None:
    how = {name: listed.how for name, listed in listed_environments().items()}
    assert how["tuckerl/CartPole-v0"] == "compiled simulator"
    assert how["tuckerl/DynaMaze-v0"] == "extracted transition table, compiled"
    team, apart = how["tuckerl/RobotRescue-v0"].split("; ")
    assert (team.split(",")[0], apart.split(",")[0]) == ("extracted transition table", "stepped in Python")
    assert how["Taxi-v4"] == how["tuckerl/DynaMaze-v0"]
    assert how["Blackjack-v1"] == "stepped in Python"
    assert how["MountainCar-v0"].endswith("put into bins")
    assert "Pendulum-v1" not in how  # its actions are continuous
    assert "CartPole-v0" not in how  # there is a later version
    assert all(listed.title for listed in listed_environments().values())


def test_a_listed_environment_is_played_as_it_is_told() -> None:
    for name, listed in listed_environments().items():
        binned = listed.how.endswith("put into bins")
        if binned:
            with pytest.raises(SpaceError, match="give bins"):
                as_problem(name)
        else:
            assert listed.how.startswith(as_problem(name, AdapterOptions(Agents.JOINT)).how_played)


def test_an_environment_that_cannot_be_made_is_not_listed(monkeypatch: pytest.MonkeyPatch) -> None:
    entry = "gymnasium.envs.toy_text.nowhere:NowhereEnv"
    monkeypatch.setitem(gymnasium.registry, "Nowhere-v0", gymnasium.envs.registration.EnvSpec("Nowhere-v0", entry))
    assert "Nowhere-v0" not in listed_environments()


def test_agents_of_an_environment_share_in_the_control_as_in_the_candidate() -> None:
    small = {"map": "..H..\nATB..", "max_cycles": 20}
    made = comparison_study(
        ComparisonConfig("q-learning", "tq-learning", "tuckerl/RobotRescue-v0", small, n_runs=1, n_episodes=20)
    )
    assert made.comparison.control == "constant-1-max"
