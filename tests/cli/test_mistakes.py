"""The likeliest mistakes of newcomers are answered with the line to type, and that line is one that can be typed."""

import json
import re
import shlex
from pathlib import Path

import numpy as np
import pytest
import typer.main

import tuckerl
from tests.cli.test_train import status_of
from tuckerl.cli import app
from tuckerl.studies.environments import BINS_THAT_LEARN

LAKE = "train q-learning FrozenLake-v1"


@pytest.mark.parametrize(
    ("typed", "meant"),
    [
        (f"{LAKE} --alpha 0.3", f"{LAKE} --set alpha=0.3"),
        (f"{LAKE} --alpha=0.3 --seed 2", f"{LAKE} --set alpha=0.3 --seed 2"),
        (f"{LAKE} --learning-rate 0.3", f"{LAKE} --set alpha=0.3"),
        (f"{LAKE} --lambda 0.3", f"{LAKE} --set lambda_=0.3"),
        (f"{LAKE} --set alpha 0.3", f"{LAKE} --set alpha=0.3"),
        (f"{LAKE} --set alpha = 0.3 --seed 3", f"{LAKE} --set alpha=0.3 --seed 3"),
        (f"{LAKE} --set alpha= 0.3", f"{LAKE} --set alpha=0.3"),
        (f"{LAKE} --set=alpha 0.3", f"{LAKE} --set alpha=0.3"),
        (f"{LAKE} --env-set is_slippery false", f"{LAKE} --env-set is_slippery=false"),
        (f"{LAKE} alpha=0.3", f"{LAKE} --set alpha=0.3"),
        (f"{LAKE} --set alpha=0.3 gamma=0.9", f"{LAKE} --set alpha=0.3 --set gamma=0.9"),
        (f"{LAKE} --episodes 1e4", f"{LAKE} --episodes 10000"),
        (f"{LAKE} --episodes=10,000", f"{LAKE} --episodes 10000"),
        (f"{LAKE} --episodes 2k --seed 1", f"{LAKE} --episodes 2000 --seed 1"),
        (f"{LAKE} --n-agents 3", f"{LAKE} --agents 3"),
        (f"{LAKE} --total-timesteps 500", f"{LAKE} --steps 500"),
        ("train --algo q-learning --env FrozenLake-v1", LAKE),
        ("train q-learning --env FrozenLake-v1 --seed 1", f"{LAKE} --seed 1"),
        ("train FrozenLake-v1 q-learning", LAKE),
        ("tune FrozenLake-v1 q-learning", "tune q-learning FrozenLake-v1"),
        ("tune q-learning FrozenLake-v1 --alpha 0.1:1", "tune q-learning FrozenLake-v1 --search alpha=0.1:1"),
        ("train q-learning", LAKE),
        ("train --seed 1", f"{LAKE} --seed 1"),
        ("compare q-learning", "compare q-learning sarsa"),
        ("compare q-learning sarsa", "compare q-learning sarsa --env FrozenLake-v1"),
        ("compare q-learning sarsa Taxi-v4 --runs 3", "compare q-learning sarsa --runs 3 --env Taxi-v4"),
        ("compare sarsa dyna-q --env Taxi-v4 --base.alpha 1", "compare sarsa dyna-q --env Taxi-v4 --set base.alpha=1"),
        (f"learn{LAKE.removeprefix('train')}", LAKE),
        ("algorithms", "list algorithms"),
        ("study lake.toml", "study run lake.toml"),
        ("study .", "study status ."),
        ("study resume", "study resume DIR"),
        ("evaluate --episodes 3", "evaluate FILE --episodes 3"),
    ],
)
def test_the_line_to_type_is_given(typed: str, meant: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert status_of(*shlex.split(typed)) == 2
    err = capsys.readouterr().err
    assert err.startswith("tuckerl: ")
    assert err.count("\n") == 1
    assert f"`tuckerl {meant}`" in err
    _check_parses(shlex.split(meant))


def _check_parses(words: list[str]) -> None:
    """Fail if the command line would not take a line; whether what it names exists is not asked."""
    command, context = typer.main.get_command(app), None
    while hasattr(command, "commands"):
        command = command.commands[words.pop(0)]
    if "sarsa" in words and "--env" not in words and command.name == "compare":
        words += ["--env", "FrozenLake-v1"]  # the next answer
    context = command.make_context(command.name, words)
    assert context is not None


@pytest.mark.parametrize(
    ("typed", "message"),
    [
        ("train tsarsa FrozenLake-v1", "did you mean 'tsarsa-lambda'?"),
        ("train qlearning FrozenLake-v1", "did you mean 'q-learning'?"),
        ("train q_learning FrozenLake-v1", "did you mean 'q-learning'?"),
        ("train tq FrozenLake-v1", "did you mean 'tq-learning'?"),
        ("train dqn FrozenLake-v1", "none of the 34 known is close; `tuckerl list algorithms` shows them"),
        ("train dyna-q maze", "did you mean 'tuckerl/DynaMaze-v0'?"),
        ("train q-learning cartpole", "did you mean 'CartPole-v1'?"),
        ("train q-learning Taxi", "did you mean 'Taxi-v4'?"),
        ("train q-learning nowhere", "`tuckerl list environments` shows some of them"),
        (f"{LAKE} --set", "--set needs NAME=VALUE after it, such as --set alpha=0.3"),
        (f"{LAKE} --episodes many", "--episodes must be a whole number, such as --episodes 100; got 'many'"),
        (f"{LAKE} nonsense", "`tuckerl train --help` shows what it takes"),
        (f"{LAKE} --nonsense 3", "--set NAME=VALUE sets a parameter and --env-set NAME=VALUE sets a keyword"),
        ("comparee", "there is no command comparee: did you mean 'compare'?"),
        ("nonsense", "there is no command nonsense: `tuckerl --help` shows those that there are"),
        ("study strat", "there is no command study strat: did you mean 'status'?"),
        ("--nonsense", "`tuckerl --help` shows those that there are"),
        ("reproduce cartpole", "did you mean 'cart-pole'?"),
        ("study run .", "`tuckerl study resume .` where a study was run into it"),
        ("study resume lake.toml", "lake.toml is a file, and a folder was asked for: `tuckerl study run lake.toml`"),
        ("study report compared", "compared holds a study that came from no file"),
        ("show compared", "compared holds the runs of a study, whose agents are not kept"),
        ("evaluate empty", "the folder empty holds no agent.tuckerl"),
        (
            "train sarsa CartPole-v1",
            "CartPole-v1 observes numbers, which tables need in bins; in a command, --set bins='",
        ),
        ("compare sarsa dyna-q --env CartPole-v1", f"--set bins='{BINS_THAT_LEARN['CartPole-v1']}'"),
    ],
)
def test_other_mistakes_are_told_in_one_sentence(
    typed: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("lake.toml").write_text("")
    for folder in ("compared", "empty"):
        Path(folder).mkdir()
    Path("compared/study.json").write_text("{}")
    assert status_of(*shlex.split(typed)) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert message in err


def test_a_folder_that_holds_an_agent_stands_for_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("lake").mkdir()
    tuckerl.QLearning("FrozenLake-v1", seed=0).learn(3).save("lake/agent.tuckerl")
    outs = []
    for place in ("lake", "lake/agent.tuckerl"):
        assert status_of("evaluate", place, "--episodes", "3") == 0
        outs.append(capsys.readouterr().out)
    assert outs[0] == outs[1]
    Path("lake/agent.tuckerl").write_bytes(b"torn")
    assert status_of("show", "lake") == 2
    assert "lake/agent.tuckerl" in capsys.readouterr().err


@pytest.mark.long
def test_the_bins_that_are_offered_learn() -> None:
    bins = json.loads(BINS_THAT_LEARN["CartPole-v1"])
    agents = [tuckerl.QLearning("CartPole-v1", bins=bins, seed=seed).learn(1000) for seed in range(3)]
    first, last = (np.mean([agent.returns[part].mean() for agent in agents]) for part in (slice(50), slice(-100, None)))
    assert last > 3 * first


def test_markup_in_names_is_shown_as_text(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("COLUMNS", "200")
    text = """
        runs = 1
        episodes = 5
        [[problem]]
        env = "FrozenLake-v1"
        name = "[red]lake[/red]"
        [[algorithm]]
        algorithm = "q-learning"
        grid = { alpha = [0.1, 0.5] }
        """
    Path("lake.toml").write_text(text)
    assert status_of("study", "status", "lake.toml") == 0
    plain = re.sub("\x1b\\[[0-9;]*m", "", capsys.readouterr().out)
    assert "[red]lake[/red]" in plain
    assert "q-learning[alpha=0.1]" in plain
