"""What users may get wrong, and the sentence that tells them."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.learners.worlds import corridor
from tuckerl import DynaH, QLearning, SarsaLambda, TabularMDP, TeamQ
from tuckerl.errors import (
    ParameterError,
    ParameterTypeError,
    ProblemError,
    SavedFileMissingError,
    TuckerlError,
    UnknownNameError,
)

PROBLEM = corridor()
NO_HEURISTIC = TabularMDP([[0]], [[0.0]], [[True]])

WRONG_PARAMETERS: list[tuple[dict[str, Any], type[TuckerlError], str]] = [
    ({"alpha": 0}, ParameterError, r"alpha must be a number in \(0, 1\]; got 0.0"),
    ({"alpha": -1.0}, ParameterError, r"alpha must be a number in \(0, 1\]; got -1.0"),
    ({"alpha": 2}, ParameterError, "alpha .* got 2.0"),
    ({"alpha": float("nan")}, ParameterError, "alpha .* got nan"),
    ({"alpha": "x"}, ParameterTypeError, "alpha .* got 'x' of type str"),
    ({"gamma": 1.1}, ParameterError, r"gamma must be a number in \[0, 1\]; got 1.1"),
    ({"gamma": None}, ParameterTypeError, "gamma .* got None"),
    ({"epsilon": -0.1}, ParameterError, "epsilon must be .* got -0.1"),
    ({"epsilon_decay": 1.5}, ParameterError, "epsilon_decay must be .* got 1.5"),
    ({"ties": "lowest"}, UnknownNameError, "unknown ties 'lowest': use one of first, random"),
    ({"ties": "randm"}, UnknownNameError, "did you mean 'random'"),
    ({"n_agents": 0}, ParameterError, "n_agents must be a whole number of at least 1; got 0"),
    ({"n_agents": 1.5}, ParameterTypeError, "n_agents .* got 1.5 of type float"),
    ({"n_agents": True}, ParameterTypeError, "n_agents .* got True"),
    ({"initial_q": np.zeros((5, 3))}, ParameterError, r"initial_q .* of shape \(5, 2\); got shape \(5, 3\)"),
    ({"initial_q": np.full((5, 2), np.inf)}, ParameterError, r"initial_q .* got shape \(5, 2\) with NaN or infinity"),
    ({"initial_q": float("nan")}, ParameterError, "initial_q must be a finite number; got nan"),
    ({"initial_q": "zeros"}, ParameterTypeError, "initial_q .* got 'zeros'"),
    ({"initial_q": [[1.0], [1.0, 2.0]]}, ParameterTypeError, r"initial_q .* got \[\[1.0\], \[1.0, 2.0\]\]"),
    ({"tensor_step": "paper"}, ParameterTypeError, "tensor_step must be a tuckerl.TensorStep or None; got 'paper'"),
    ({"bootstrap_terminal": 1}, ParameterTypeError, "bootstrap_terminal must be True or False; got 1"),
    ({"seed": -1}, ParameterError, "seed must be a whole number of at least 0; got -1"),
    ({"seed": "one"}, ParameterTypeError, "seed .* got 'one'"),
    ({"lambda_": 0.5}, ParameterTypeError, "QLearning has no parameter 'lambda_': it takes alpha, gamma"),
]


@pytest.mark.parametrize(("parameters", "error", "message"), WRONG_PARAMETERS)
def test_wrong_parameters(parameters: dict[str, Any], error: type[TuckerlError], message: str) -> None:
    with pytest.raises(error, match=message):
        QLearning(PROBLEM, **parameters)


@pytest.mark.parametrize(
    ("parameters", "error", "message"),
    [
        ({"planning_steps": -1}, ParameterError, "planning_steps must be a whole number from 0 to 92.*; got -1"),
        ({"planning_steps": 2**63}, ParameterError, "planning_steps must be a whole number from 0 to 92.*; got 92"),
        ({"planning_steps": 1.0}, ParameterTypeError, "planning_steps .* got 1.0"),
        (
            {"search_control": "trajectry"},
            UnknownNameError,
            "unknown search_control 'trajectry': did you mean 'trajectory'",
        ),
        ({"search_control": "sideways"}, UnknownNameError, "use one of random, restart, trajectory"),
        ({"heuristic": np.zeros(4)}, ProblemError, r"heuristic must be 5 finite numbers.* shape \(4,\)"),
        ({"heuristic": [np.inf] * 5}, ProblemError, "not finite"),
        ({"alpha": 0}, ParameterError, "alpha"),
        ({"plans": 3}, ParameterTypeError, "DynaH has no parameter 'plans'"),
        ({"planing_steps": 3}, ParameterTypeError, "'planing_steps': did you mean 'planning_steps'"),
    ],
)
def test_wrong_parameters_of_dyna_h(parameters: dict[str, Any], error: type[TuckerlError], message: str) -> None:
    with pytest.raises(error, match=message):
        DynaH(PROBLEM, **parameters)


WRONG_TRACES: list[tuple[dict[str, Any], type[TuckerlError], str]] = [
    ({"lambda_": -0.1}, ParameterError, r"lambda_ must be a number in \[0, 1\]; got -0.1"),
    ({"lambda_": 1.1}, ParameterError, r"lambda_ must be a number in \[0, 1\]; got 1.1"),
    ({"lambda_": float("nan")}, ParameterError, "lambda_ .* got nan"),
    ({"lambda_": "x"}, ParameterTypeError, "lambda_ .* got 'x' of type str"),
    ({"trace": "replaceing"}, UnknownNameError, "unknown trace 'replaceing': did you mean 'replacing'"),
    ({"trace": 1}, ParameterTypeError, "trace must be one of accumulating, replacing; got 1"),
    ({"carry_trace": None}, ParameterTypeError, "carry_trace must be True or False; got None"),
    ({"bootstrap_terminal": "no"}, ParameterTypeError, "bootstrap_terminal must be True or False; got 'no'"),
    ({"gamma": 2}, ParameterError, "gamma"),
]


@pytest.mark.parametrize("learner", [SarsaLambda, TeamQ])
@pytest.mark.parametrize(("parameters", "error", "message"), WRONG_TRACES)
def test_wrong_parameters_of_traces(
    learner: Any, parameters: dict[str, Any], error: type[TuckerlError], message: str
) -> None:
    with pytest.raises(error, match=message):
        learner(PROBLEM, **parameters)


@pytest.mark.parametrize(
    ("parameters", "error", "message"),
    [
        ({"cut_traces": 1}, ParameterTypeError, "cut_traces must be True or False; got 1"),
        ({"exploration": "nobody"}, UnknownNameError, "unknown exploration 'nobody': use one of independent, joint"),
        ({"exploration": 2}, ParameterTypeError, "exploration must be one of independent, joint; got 2"),
        ({"team": 3}, ParameterTypeError, "TeamQ has no parameter 'team'"),
    ],
)
def test_wrong_parameters_of_teams(parameters: dict[str, Any], error: type[TuckerlError], message: str) -> None:
    with pytest.raises(error, match=message):
        TeamQ(PROBLEM, **parameters)


def test_sarsa_lambda_has_no_cut() -> None:
    with pytest.raises(ParameterTypeError, match="SarsaLambda has no parameter 'cut_traces'"):
        SarsaLambda(PROBLEM, cut_traces=True)  # type: ignore[call-arg]  # wrong on purpose


def test_dyna_h_without_any_heuristic() -> None:
    with pytest.raises(
        ProblemError, match=r"DynaH needs a heuristic and this problem has none .* pass heuristic=, 1 num"
    ):
        DynaH(NO_HEURISTIC)
    assert DynaH(NO_HEURISTIC, heuristic=[0.0]).learn(1).episodes == 1


@pytest.mark.parametrize(
    ("episodes", "error"),
    [(0, ParameterError), (-1, ParameterError), (2.5, ParameterTypeError), ("2", ParameterTypeError)],
)
def test_wrong_numbers_of_episodes(episodes: Any, error: type[TuckerlError]) -> None:
    learner = QLearning(PROBLEM, seed=0)
    with pytest.raises(error, match=f"episodes must be a whole number of at least 1; got {episodes!r}"):
        learner.learn(episodes)
    assert learner.episodes == 0


@pytest.mark.parametrize(
    ("observation", "error", "message"),
    [
        (5, ParameterError, "a state from 0 to 4; got 5"),
        (-1, ParameterError, "a state from 0 to 4; got -1"),
        ([0, 7], ParameterError, r"got \[0, 7\]"),
        (0.0, ParameterTypeError, "a state's number; got 0.0"),
        pytest.param(10**5000, ParameterTypeError, r"got about 10\^5000", id="more digits than Python writes"),
        ("left", ParameterTypeError, "got 'left'"),
        (True, ParameterTypeError, "got True"),
    ],
)
def test_wrong_observations(observation: Any, error: type[TuckerlError], message: str) -> None:
    with pytest.raises(error, match=message):
        QLearning(PROBLEM, seed=0).predict(observation)


def test_predictions() -> None:
    learner = QLearning(PROBLEM, seed=0, epsilon=0.5, n_agents=2)
    learner._state.q[0] = [[0, 1], [1, 0], [2, 2], [-1, -2], [0, 0]]
    learner._state.q[1] = 7.0  # agent 0's table is asked
    action, state = learner.predict(0)
    assert (action, state) == (1, None)
    assert type(action) is int
    actions, _ = learner.predict(np.arange(5))
    assert actions.tolist() == [1, 0, 0, 0, 0]
    assert learner.predict(np.array([[0, 1], [0, 1]]))[0].tolist() == [[1, 0], [1, 0]]
    explored = learner.predict(np.zeros(4000, dtype=np.int64), deterministic=False)[0]
    assert 0.72 < explored.mean() < 0.78  # 1/2 + 1/2 x 1/2


def test_saving_into_a_folder_that_does_not_exist(tmp_path: Path) -> None:
    with pytest.raises(OSError, match=r"cannot write .*nowhere.*: No such file.* choose a folder"):
        QLearning(PROBLEM, seed=0).save(tmp_path / "nowhere" / "agent.tuckerl")


def test_numbers_too_large_for_a_float_are_refused() -> None:
    with pytest.raises(ParameterError, match="alpha must be a number in"):
        QLearning(PROBLEM, alpha=10**400)


def test_a_missing_file_is_both_kinds_of_error(tmp_path: Path) -> None:
    with pytest.raises(SavedFileMissingError, match="there is no file") as caught:
        QLearning.load(tmp_path / "nothing.tuckerl")
    assert isinstance(caught.value, FileNotFoundError)
