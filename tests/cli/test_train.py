"""Training, evaluating and looking inside, as a user of the command meets them."""

import json
import re
import signal
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NoReturn

import gymnasium
import numpy as np
import polars as pl
import pytest
from gymnasium.wrappers import TimeLimit

import tuckerl
from tests.cli import pennies_world
from tests.cli.moody_world import ID, Mood, Moody
from tuckerl.cli import main
from tuckerl.training.learner import Learner

MOODY = f"tests.cli.moody_world:{ID}"
LAKE = ["train", "tsarsa-lambda", "FrozenLake-v1", "--set", "alpha=0.2", "--set", "floor=0.1", "--agents", "3"]
DRY = ["--env-set", "is_slippery=false"]
LEARNED = ["agent.tuckerl", "history.parquet", "run.json"]


def status_of(*arguments: str) -> object:
    with pytest.raises(SystemExit) as end:
        main(list(arguments))
    return end.value.code


@pytest.fixture(autouse=True)
def _calm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.chdir(tmp_path)
    yield
    Mood.left, Mood.act = -1, None


@pytest.mark.slow
def test_an_agent_is_trained_evaluated_and_shown(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert status_of(*LAKE, "--episodes", "40", "--out", "lake") == 0
    out, err = capsys.readouterr()
    assert err.splitlines()[0] == (
        "FrozenLake-v1: its transition table (16 states, 4 actions) is played in compiled code; "
        "--set compiled=false steps the environment instead"
    )
    history = pl.read_parquet("lake/history.parquet")
    assert history.shape == (120, 4)
    lines = out.splitlines()
    assert lines[0].startswith(f"40 episodes, {int(history['steps'].sum()):,} steps")
    last = history.filter(pl.col("episode") >= 36)["return"].to_numpy().mean()
    assert lines[1] == f"Mean return of the last 4 episodes of learning: {last:.4g}"
    assert re.match(r"Mean return of 100 greedy episodes: [\d.]+, 95 % interval [\d.]+ to [\d.]+$", lines[2])
    assert lines[4] == "Agent: lake/agent.tuckerl"
    assert sorted(path.name for path in Path("lake").iterdir()) == LEARNED
    run = json.loads(Path("lake/run.json").read_text())
    assert (run["algorithm"], run["learner"], run["played"], run["finished"]) == (
        "tsarsa-lambda",
        "SarsaLambda",
        "table",
        True,
    )
    assert run["tensor_step"]["share"] == "min"
    assert run["parameters"]["lambda_"] == 0.95

    assert status_of("evaluate", "lake/agent.tuckerl") == 0
    assert capsys.readouterr().out.splitlines()[1:3] == lines[2:4], "the same stream as at the end of training"
    assert status_of("evaluate", "lake/agent.tuckerl", "--episodes", "1", "--seed", "3") == 0
    assert re.search(r"^Mean return of 1 greedy episode: [01]$", capsys.readouterr().out, re.MULTILINE)

    assert status_of("show", "lake/agent.tuckerl") == 0
    shown = capsys.readouterr().out
    assert "Learned: 40 episodes, 3 agents" in shown
    assert "Page: results/show/lake/inspect.html" in shown
    assert "left" in Path("results/show/lake/inspect.html").read_text()
    assert Path("results/show/lake/figures/policy.png").stat().st_size > 1000


def test_a_finished_agent_is_left_alone_resumed_or_replaced(capsys: pytest.CaptureFixture[str]) -> None:
    few = [*LAKE, "--out", "lake", "--evaluate", "0", "--episodes"]
    assert status_of(*few, "25") == 0
    first = Path("lake/agent.tuckerl").read_bytes()
    capsys.readouterr()
    assert status_of(*few, "25") == 0
    assert capsys.readouterr().out.startswith(
        "Nothing to do: lake/agent.tuckerl has learned this already (25 episodes)"
    )
    assert status_of(*few, "40") == 2
    assert "(25 episodes there and 40 episodes now): --resume goes on" in capsys.readouterr().err
    assert Path("lake/agent.tuckerl").read_bytes() == first
    assert status_of(*few, "40", "--resume") == 0
    assert status_of(*LAKE, "--out", "whole", "--evaluate", "0", "--episodes", "40", "--checkpoint", "7") == 0
    for name in LEARNED:
        assert (Path("lake") / name).read_bytes() == (Path("whole") / name).read_bytes(), name
    assert status_of(*few, "25", "--resume") == 2
    assert "lake holds 40 episodes, more than the 25 asked for" in capsys.readouterr().err
    assert status_of(*few, "40", "--seed", "1") == 2
    assert "(seed is 0 there and 1 now)" in capsys.readouterr().err
    assert status_of(*few, "25", "--overwrite") == 0
    assert Path("lake/agent.tuckerl").read_bytes() == first


def test_greedy_episodes_that_fail_are_said_with_what_to_try(capsys: pytest.CaptureFixture[str]) -> None:
    wanted = ["train", "q-learning", "FrozenLake-v1", "--env-set", "max_episode_steps=3", "--episodes", "20"]
    assert status_of(*wanted, "--out", "lake") == 0
    said = "All 100 greedy episodes were cut off after 3 steps. If that is not what was wanted, try: more episodes "
    assert said in capsys.readouterr().out
    assert status_of("evaluate", "lake/agent.tuckerl") == 0
    assert said in capsys.readouterr().out


def test_steps_can_be_the_goal() -> None:
    assert status_of(*LAKE, "--out", "lake", "--steps", "300", "--evaluate", "0") == 0
    history = pl.read_parquet("lake/history.parquet").filter(pl.col("agent") == 0)["steps"]
    assert history.sum() >= 300 > history[:-1].sum()


@pytest.mark.parametrize("env_settings", [[], ["--env-set", "length=5"]])
@pytest.mark.parametrize("algorithm", ["tq-learning", "sarsa"])
def test_after_ctrl_c_the_same_command_goes_on_to_the_same_bits(
    algorithm: str, env_settings: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    wanted = ["train", algorithm, MOODY, "--agents", "2", "--episodes", "30", *env_settings, "--evaluate", "0", "--out"]
    Mood.left, Mood.act = 150, lambda: signal.raise_signal(signal.SIGINT)
    assert status_of(*wanted, "agent") == 130
    assert "the same command goes on from there" in capsys.readouterr().err
    assert not json.loads(Path("agent/run.json").read_text())["finished"]
    assert 0 < tuckerl.load("agent/agent.tuckerl", env=None if not env_settings else _five()).episodes <= 30
    assert status_of(*wanted, "agent") == 0
    assert status_of(*wanted, "whole") == 0
    for name in LEARNED:
        assert (Path("agent") / name).read_bytes() == (Path("whole") / name).read_bytes(), name
    assert status_of("evaluate", "agent/agent.tuckerl", "--episodes", "2") == 0


def _five() -> TimeLimit[int, int]:
    return TimeLimit(Moody(5), 50)


def test_what_was_learned_before_an_environment_fails_is_kept(capsys: pytest.CaptureFixture[str]) -> None:
    def fail() -> NoReturn:
        raise RuntimeError("the motor is off")

    Mood.left, Mood.act = 200, fail
    assert status_of("train", "sarsa", MOODY, "--out", "agent") == 2
    told = capsys.readouterr().err.splitlines()
    assert told[0] == f"{MOODY}: stepped in Python (5 states, 2 actions)"
    assert re.search(r"failed \(RuntimeError: the motor is off\) in step \d+ of episode \d+ .*seed \d+", told[1])
    assert told[1].endswith("saved in agent/agent.tuckerl")
    assert len(told) == 2
    assert tuckerl.load("agent/agent.tuckerl").episodes > 5


def test_checkpoints_are_written_while_learning(monkeypatch: pytest.MonkeyPatch) -> None:
    episodes = []
    save = Learner.save

    def noting(learner: Learner, path: str) -> None:
        episodes.append(learner.episodes)
        save(learner, path)

    monkeypatch.setattr(Learner, "save", noting)
    assert status_of(*LAKE, "--episodes", "50", "--checkpoint", "20", "--evaluate", "0", "--out", "lake") == 0
    assert episodes == [20, 40, 50]


def test_commands_find_modules_in_the_current_folder_after_all_others(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    elsewhere = [place for place in sys.path if place not in ("", str(Path.cwd()))]
    monkeypatch.setattr(sys, "path", list(elsewhere))
    world = (
        "import gymnasium\n"
        "from tests.cli.moody_world import Moody\n"
        "gymnasium.register('Here-v0', entry_point=Moody, max_episode_steps=9)\n"
    )
    Path("moody_here.py").write_text(world)
    Path("json.py").write_text("raise ValueError('the wrong one')")

    def forget() -> None:
        assert sys.path == elsewhere
        monkeypatch.delitem(sys.modules, "moody_here")
        monkeypatch.delitem(gymnasium.registry, "Here-v0")

    assert status_of("train", "sarsa", "moody_here:Here-v0", "--episodes", "3", "--out", "agent") == 0
    for command in (["evaluate"], ["evaluate", "--episodes", "2", "--env", "moody_here:Here-v0"], ["show"]):
        forget()
        assert status_of(command[0], "agent/agent.tuckerl", *command[1:]) == 0
    keywords = ["--env-set", "length=5"]
    forget()
    assert status_of("train", "sarsa", "moody_here:Here-v0", "--episodes", "3", "--out", "five", *keywords) == 0
    forget()
    assert status_of("evaluate", "five/agent.tuckerl") == 0  # which only run.json says how to make
    forget()
    Path("moody_here.py").unlink()
    capsys.readouterr()
    assert status_of("evaluate", "agent/agent.tuckerl") == 2
    assert capsys.readouterr().err.endswith("name what it learned on with --env\n")


def test_numbers_can_follow_schedules(capsys: pytest.CaptureFixture[str]) -> None:
    wanted = ["train", "q-learning", "FrozenLake-v1", "--evaluate", "0", "--set", "alpha=Harmonic(0.5, half_after=9)"]
    wanted += ["--set", "epsilon=Linear(0.2,0,20)", "--out", "lake", "--episodes"]
    assert status_of(*wanted, "10") == 0
    assert status_of(*wanted, "30", "--resume") == 0
    schedules = {"alpha": tuckerl.Harmonic(0.5, 9.0), "epsilon": tuckerl.Linear(0.2, 0.0, 20)}
    learner: Any = tuckerl.QLearning("FrozenLake-v1", seed=0, **schedules)  # type: ignore[arg-type]  # by name, as the command gives them
    assert np.array_equal(tuckerl.load("lake/agent.tuckerl").q, learner.learn(30).q)
    capsys.readouterr()
    assert status_of(*[text.replace("20)", "21)") for text in wanted], "30") == 2
    assert "settings.epsilon.episodes is 20 there and 21 now" in capsys.readouterr().err


def test_returns_are_told_by_agent_where_they_differ(capsys: pytest.CaptureFixture[str]) -> None:
    wanted = ["train", "q-learning", f"tests.cli.pennies_world:{pennies_world.ID}", "--set", "compiled=false"]
    assert status_of(*wanted, "--episodes", "30", "--evaluate", "5", "--out", "pennies") == 0
    lines = capsys.readouterr().out.splitlines()
    returns = tuckerl.load("pennies/agent.tuckerl").returns[-3:].mean(axis=0)
    assert returns[0] == -returns[1] != 0
    assert lines[1] == "Mean return of the last 3 episodes of learning: 0"
    assert lines[2] == f"By agent: same {returns[0]:.4g}, other {returns[1]:.4g}"
    assert lines[3].startswith("Mean return of 5 greedy episodes: 0")
    assert re.fullmatch(r"By agent: same (-?\d), other (-?\d)", lines[4])
    assert status_of("evaluate", "pennies/agent.tuckerl", "--episodes", "5") == 0
    assert capsys.readouterr().out.splitlines()[2] == lines[4]


@pytest.mark.parametrize(
    "env", [["tuckerl/RobotRescue-v0", "--episodes", "2"], ["FrozenLake-v1", "--agents", "3", "--episodes", "500"]]
)
def test_returns_are_not_told_by_agent_where_all_want_the_same(
    env: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert status_of("train", "q-learning", *env, "--evaluate", "0") == 0
    assert "By agent" not in capsys.readouterr().out


def test_bins_can_be_quantiles(capsys: pytest.CaptureFixture[str]) -> None:
    wanted = ["train", "q-learning", "CartPole-v1", "--episodes", "5", "--evaluate", "2", "--out", "pole"]
    assert status_of(*wanted, "--quantile-bins", "1,1,3,2") == 0
    assert "CartPole-v1: stepped in Python (6 states, 2 actions)" in capsys.readouterr().err
    assert tuckerl.QLearning.load("pole/agent.tuckerl").n_agents == 1, "where nobody asks for more"
    assert status_of("evaluate", "pole/agent.tuckerl", "--episodes", "2") == 0
    assert status_of(*wanted, "--quantile-bins", "1,1,3,3") == 2
    assert "(quantile_bins is [1, 1, 3, 2] there and [1, 1, 3, 3] now)" in capsys.readouterr().err


def test_bins_of_a_team_can_be_quantiles(capsys: pytest.CaptureFixture[str]) -> None:
    wanted = ["train", "team-q", f"tests.cli.pennies_world:{pennies_world.WEIGHED}", "--episodes", "3", "--out", "team"]
    assert status_of(*wanted, "--quantile-bins", "2") == 0
    assert "(4 states, 4 actions)" in capsys.readouterr().err


def test_warnings_are_one_line_and_default_ranks_need_none(capsys: pytest.CaptureFixture[str]) -> None:
    wanted = [*LAKE, "--episodes", "500", "--evaluate", "0", "--out", "lake", "--overwrite"]
    assert status_of(*wanted) == 0
    assert capsys.readouterr().err.count("\n") == 1
    assert status_of(*wanted, "--set", "ranks=15,3,9,1") == 0  # the same, but chosen
    told = capsys.readouterr().err.splitlines()
    assert told[1].startswith("tuckerl: warning: ranks (15, 3, 9, 1) are more than")
    assert len(told) == 2


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["tsarsa", "FrozenLake-v1"], "unknown algorithm 'tsarsa': did you mean 'tsarsa-lambda'?"),
        (["sarsa", "FrozenLak-v1"], "unknown environment 'FrozenLak-v1': did you mean 'FrozenLake-v1'?"),
        (["sarsa", "no_such:FrozenLake-v1"], "there is no module 'no_such' to import"),
        (
            ["sarsa", "FrozenLake-v1", "--set", "alhpa=1"],
            "sarsa has no parameter 'alhpa': did you mean 'alpha'?; `tuckerl list sarsa` tells of each",
        ),
        (["sarsa", "FrozenLake-v1", "--set", "alpha=2"], "alpha must be a number in (0, 1]; got 2.0"),
        (["sarsa", "FrozenLake-v1", "--set", "n_agents=2"], "give the number of agents with --agents"),
        (["sarsa", "FrozenLake-v1", "--env-set", "slippery=1"], "cannot make FrozenLake-v1 with slippery=1"),
        (["sarsa", "FrozenLake-v1", "--episodes", "0"], "episodes must be a whole number of at least 1; got 0"),
        (["sarsa", "FrozenLake-v1", "--steps", "0"], "steps must be a whole number of at least 1; got 0"),
        (["sarsa", "FrozenLake-v1", "--episodes", "9", "--steps", "9"], "--episodes or --steps, not both; got 9 and 9"),
        (["sarsa", "FrozenLake-v1", "--agents", "0"], "agents must be a whole number of at least 1; got 0"),
        (["sarsa", "FrozenLake-v1", "--seed", "-1"], "seed must be a whole number of at least 0; got -1"),
        (["sarsa", "FrozenLake-v1", "--checkpoint", "0"], "Invalid value for '--checkpoint'"),
        (["sarsa", "FrozenLake-v1", "--evaluate", "-1"], "Invalid value for '--evaluate'"),
        (["sarsa", "FrozenLake-v1", "--resume"], "holds no agent to go on with: leave --resume out"),
        (["sarsa", "FrozenLake-v1", "--resume", "--overwrite"], "give --resume to go on or --overwrite"),
        (["sarsa", "FrozenLake-v1", "--set", "bins=9"], "bins are for environments whose observations are a Box"),
        (["sarsa", "FrozenLake-v1", "--quantile-bins", "9"], "quantile_edges needs an environment that observes a Box"),
        (["sarsa", "CartPole-v1", "--quantile-bins", "x"], "--quantile-bins must be whole numbers with commas"),
        (["sarsa", "CartPole-v1", "--quantile-bins", "9", "--set", "bins=9"], "--quantile-bins, not both"),
        (["sarsa", "MountainCar-v0"], "give bins, how many or with which edges for each dimension"),
        (["sarsa", "MountainCar-v0"], "in a command, --set bins=20, or a number or edges for each dimension"),
        (["sarsa", "CartPole-v1", "--set", "bins=9"], "has no bounds to space bins between in dimensions 1, 3"),
        (["sarsa", "CartPole-v1", "--set", "bins=9"], "--quantile-bins 20"),
        (["sarsa", "Pendulum-v1", "--set", "bins=9"], "action must be one of finitely many; got Box(-2.0, 2.0"),
        (["team-q", "FrozenLake-v1"], "team-q plays the joint actions of several agents, and FrozenLake-v1 has one"),
        (["q-learning", "tuckerl/RobotRescue-v0", "--agents", "2"], "n_agents must stay 1"),
        (["dyna-h", "FrozenLake-v1"], "DynaH needs a heuristic"),
        (["sarsa", "FrozenLake-v1", "--out", "file/results"], "cannot make the folder file/results"),
        (["sarsa", "FrozenLake-v1", "--out", "torn"], "torn holds another agent (its run.json cannot be read)"),
        (["sarsa", "FrozenLake-v1", "--out", "alone"], "alone holds another agent (agent.tuckerl without run.json)"),
    ],
)
def test_wrong_training_is_one_sentence_and_status_2(
    arguments: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("file").write_text("")
    for folder, name in (("torn", "run.json"), ("alone", "agent.tuckerl")):
        Path(folder).mkdir()
        (Path(folder) / name).write_text("{")
    before = sorted(tmp_path.rglob("*"))
    assert status_of("train", *arguments) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.splitlines()[-1].startswith("tuckerl: ")
    assert err.count("\n") == 1
    assert message in err
    assert sorted(tmp_path.rglob("*")) == before, "nothing is written"


def _saved(name: str) -> Path:
    tuckerl.Sarsa("FrozenLake-v1", seed=0).learn(3).save("whole.tuckerl")
    content = Path("whole.tuckerl").read_bytes()
    Path("cut.tuckerl").write_bytes(content[:-100])
    Path("newer.tuckerl").write_bytes(content.replace(b"format 3", b"format 99", 1))
    Path("text.tuckerl").write_text("text")
    tuckerl.Sarsa("Blackjack-v1", seed=0).learn(3).save("cards.tuckerl")
    tuckerl.QLearning("tuckerl/CartPole-v0", seed=0).learn(3).save("pole.tuckerl")
    X = np.ones((4, 2, 3, 1))
    np.save("good.npy", X)
    np.savez("two.npz", a=X, b=X)
    np.save("flat.npy", X[0])
    np.save("nan.npy", np.full((4, 2, 3, 1), np.nan))
    np.save("words.npy", np.full((4, 2, 3, 1), "word"))
    np.save("objects.npy", np.array([{}], dtype=object), allow_pickle=True)
    Path("cut.npy").write_bytes(Path("good.npy").read_bytes()[:-8])
    Path("cut.npz").write_bytes(Path("two.npz").read_bytes()[:-200])
    return Path(name)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("evaluate none.tuckerl", "there is no file none.tuckerl"),
        ("evaluate .", "the folder . holds no agent.tuckerl: name one that `tuckerl train` made, or a file"),
        ("evaluate cut.tuckerl", "cut.tuckerl is truncated or damaged"),
        ("evaluate newer.tuckerl", "newer.tuckerl has format 99, and this version of tuckerl reads up to format 3"),
        ("evaluate text.tuckerl", "text.tuckerl is not a saved learner"),
        ("evaluate good.npy", "good.npy is not a saved learner"),
        ("evaluate whole.tuckerl --episodes 0", "episodes must be a whole number of at least 1; got 0"),
        ("evaluate whole.tuckerl --env Blackjack-v1", "saved with: kind was table; got gymnasium"),
        ("evaluate whole.tuckerl --env-set a=1", "give --env with --env-set"),
        ("evaluate cards.tuckerl --env FrozenLake-v1", "env must be the one that cards.tuckerl was saved with"),
        ("evaluate cards.tuckerl --env Blackjak-v1", "unknown environment 'Blackjak-v1'"),
        ("evaluate pole.tuckerl", "was learned on a simulator, whose functions no file holds: pass load() its env, or"),
        ("show none.npy", "there is no file none.npy"),
        ("show .", "the folder . holds no agent.tuckerl: name one that `tuckerl train` made, or a file"),
        ("show cut.tuckerl", "cut.tuckerl is truncated or damaged"),
        ("show text.tuckerl", "text.tuckerl is not a saved learner"),
        ("show whole.tuckerl --ranks 1,1,1,1", "ranks are for a tensor of Q-tables; whole.tuckerl is a saved agent"),
        ("show whole.tuckerl --layout 3,4", "layout must be (rows, columns) of 16 cells; got (3, 4)"),
        ("show whole.tuckerl --layout 3", "--layout must be 2 whole numbers with commas between them; got '3'"),
        ("show whole.tuckerl --out text.tuckerl/x", "cannot make the folder text.tuckerl/x/figures"),
        ("show good.npy --env FrozenLake-v1", "good.npy is an array: leave --env out"),
        ("show good.npy --ranks 0,1,1,1", "ranks[0] must be a whole number of at least 1; got 0"),
        ("show good.npy --ranks 1.5", "ranks, as a share of the energy, must be a number in (0, 1]; got 1.5"),
        (
            "show good.npy --ranks abc",
            "or 'auto' or a share of the energy such as 0.95; got 'abc' of type str",
        ),
        ("show good.npy --layout 2,3", "layout must be (rows, columns) of 4 cells; got (2, 3)"),
        ("show two.npz", "two.npz must hold one array, the tensor of Q-tables; it holds a, b"),
        ("show flat.npy", "must have the axes (state, action, episode, agent); got shape (2, 3, 1)"),
        ("show nan.npy", "nan.npy has NaN or infinity in it"),
        ("show words.npy", "must hold real numbers; words.npy has dtype <U4"),
        ("show objects.npy", "objects.npy holds Python objects, which may run code"),
        ("show cut.npy", "cut.npy holds no readable array"),
        ("show cut.npz", "cut.npz holds no readable array"),
    ],
)
def test_wrong_files_are_one_sentence_and_status_2(
    arguments: str, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    _saved("whole.tuckerl")
    assert status_of(*arguments.split()) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("tuckerl: ")
    assert err.count("\n") == 1
    assert message in err


def test_a_simulator_is_evaluated_by_its_environment() -> None:
    _saved("pole.tuckerl")
    assert status_of("evaluate", "pole.tuckerl", "--env", "tuckerl/CartPole-v0", "--episodes", "2") == 0


@pytest.mark.slow
def test_tensors_are_shown(capsys: pytest.CaptureFixture[str]) -> None:
    X = np.zeros((6, 2, 3, 2))
    X[1:] = np.random.default_rng(0).normal(size=(5, 2, 3, 2))
    np.savez("tables.npz", X)
    fit = tuckerl.tucker(X[1:], (3, 1, 3, 1)).fit
    found = tuckerl.tucker(X[1:], 0.8)
    assert status_of("show", "tables.npz", "--layout", "2,3", "--out", "looked") == 0
    assert capsys.readouterr().out.splitlines() == [
        "Tensor: 6 states, 2 actions, 3 episodes and 2 agents",
        f"Decomposition with ranks (3, 1, 3, 1): fit {fit:.3g}",
        "Page: looked/inspect.html",
    ]
    assert Path("looked/figures/policy.svg").exists()
    assert status_of("show", "tables.npz", "--ranks", "0.8", "--out", "looked") == 0
    assert f"Decomposition with ranks {found.ranks}: fit {found.fit:.3g}" in capsys.readouterr().out
