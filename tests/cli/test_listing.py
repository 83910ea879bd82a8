import pytest
from rich.console import Console
from typer import Typer

from tuckerl.cli import COMMANDS, listing, main
from tuckerl.environments import ENVIRONMENTS, PARALLEL_ENVIRONMENTS
from tuckerl.generalization.sharing import SHARING_RULES
from tuckerl.generalization.weights import WEIGHTINGS
from tuckerl.studies.algorithms import ALGORITHMS, parameters_of
from tuckerl.training.policies import POLICIES


def listed(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    with pytest.raises(SystemExit) as end:
        main(["list", *arguments])
    assert end.value.code == 0
    return capsys.readouterr().out


@pytest.mark.parametrize(
    ("kind", "names"),
    [
        ("algorithms", list(ALGORITHMS)),
        ("scenarios", ["cart-pole", "dyna-maze", "robot-rescue"]),
        ("policies", list(POLICIES)),
        ("weights", list(WEIGHTINGS)),
        ("shares", list(SHARING_RULES)),
    ],
)
def test_plain_lines_begin_with_the_name(kind: str, names: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    lines = [line.split("\t") for line in listed([kind], capsys).splitlines()]
    assert [line[0] for line in lines] == names
    assert all(column for line in lines for column in line), "every name is explained"


def test_environments_begin_with_the_librarys_own(capsys: pytest.CaptureFixture[str]) -> None:
    names = [line.split("\t")[0] for line in listed(["environments"], capsys).splitlines()]
    assert names[:3] == [*ENVIRONMENTS, *PARALLEL_ENVIRONMENTS]
    assert "FrozenLake-v1" in names


def test_all_is_the_default(capsys: pytest.CaptureFixture[str]) -> None:
    every = listed([], capsys)
    assert every == "".join(listed([kind], capsys) for kind in listing.LISTINGS)


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_an_algorithms_parameters_are_told(algorithm: str, capsys: pytest.CaptureFixture[str]) -> None:
    lines = [line.split("\t") for line in listed([algorithm], capsys).splitlines()]
    assert [line[0] for line in lines] == list(parameters_of(ALGORITHMS[algorithm]))
    assert all(len(line) == 4 and line[1] and line[3] for line in lines)
    assert not any(":class:" in line[3] or "``" in line[3] for line in lines)


def test_parameters_have_their_types_defaults_and_meanings(capsys: pytest.CaptureFixture[str]) -> None:
    told = {line.split("\t")[0]: line.split("\t")[1:] for line in listed(["tsarsa-lambda"], capsys).splitlines()}
    assert told["alpha"] == [
        "0.1",
        "float in (0, 1] or Schedule",
        "Learning rate; a schedule such as tuckerl.Harmonic(0.5, half_after=1000) changes it from episode to episode",
    ]
    assert told["lambda_"] == ["0.95", "float in [0, 1]", "How strongly traces last; 0 is the one-step algorithm"]
    assert told["share"][0] == "min", "as the paper's T-SARSA(lambda) has it"
    assert told["ranks"][0] == "from the sizes"
    assert told["tol"] == ["0.0001", "float, int", "When the decomposition stops; 0 iterations is the truncated HOSVD"]


def test_an_algorithms_parameters_are_a_table_on_a_terminal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(listing, "Console", lambda: Console(force_terminal=True, width=100))
    shown = listed(["sarsa"], capsys)
    assert "Default" in shown
    assert "Parameters of sarsa, for --set" in shown


@pytest.mark.parametrize("command", ["train", "compare"])
def test_the_way_to_the_parameters_is_shown(
    command: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    with pytest.raises(SystemExit):
        main([command, "--help"])
    assert "`tuckerl list ALGORITHM` shows an algorithm's" in capsys.readouterr().out


@pytest.mark.parametrize("command", ["train", "compare", "reproduce"])
def test_what_no_seed_decides_is_said(
    command: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "400")
    with pytest.raises(SystemExit):
        main([command, "--help"])
    assert "not what an environment takes from elsewhere, such as the clock" in capsys.readouterr().out


def test_on_a_terminal_there_are_tables(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(listing, "Console", lambda: Console(force_terminal=True, width=100))
    shown = listed(["environments"], capsys)
    assert "How it is played" in shown
    assert "MODULE:ID" in shown
    assert "\t" not in shown


def test_an_unknown_kind_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main(["list", "algoritms"])
    assert end.value.code == 2
    assert capsys.readouterr().err == "tuckerl: unknown kind 'algoritms': did you mean 'algorithms'?\n"


def test_every_command_and_scenario_has_a_description(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["--help"])
    shown = capsys.readouterr().out
    for name, command in COMMANDS.items():
        assert name in shown
        of_group = [one.callback for one in command.registered_commands] if isinstance(command, Typer) else [command]
        assert of_group
        for function in of_group:
            assert (function.__doc__ or "").strip()
    assert "the paper's section IV.A" in listed(["scenarios"], capsys)
