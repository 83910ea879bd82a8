"""What came through unnamed when calls were made with odd arguments, a case of each kind."""

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, TypedDict

import gymnasium
import numpy as np
import pettingzoo
import pytest

import tuckerl
from tests.calls.values import learner, mdp, nested
from tuckerl import cli, errors
from tuckerl.adapters.making import make_environment
from tuckerl.cli.settings import parse_numbers, parse_settings
from tuckerl.environments.robot_rescue import robot_rescue
from tuckerl.environments.robot_rescue_env import RobotRescueEnv
from tuckerl.reports.inspect import inspect_learner, inspect_tensor, inspection_figures, write_inspection
from tuckerl.saved_json import checked_json
from tuckerl.spaces.encoder import space_encoder
from tuckerl.studies import cart_pole
from tuckerl.studies.study import variant
from tuckerl.testing import check_learner, check_problem
from tuckerl.training.declared_state import DeclaredArray
from tuckerl.training.policies.own_distribution import OwnDistribution

X = np.ones((4, 2, 3, 2))
MAZE = tuckerl.sutton_maze()
HUGE = 10**5000  # which Python does not write


def of_table(**parts: Any) -> tuckerl.TabularMDP:
    return tuckerl.TabularMDP([[0, 0]], [[0.0, 0.0]], [[True, True]], **parts)


def begun(env: Any) -> Any:
    env.reset(seed=0)
    return env


class WithoutSpaces(pettingzoo.ParallelEnv):  # type: ignore[misc]  # PettingZoo has no types
    """An environment whose author forgot the agents' spaces."""

    possible_agents = ("a", "b")


WRONG: dict[str, tuple[Callable[[Any], Any], list[Any], str]] = {
    "Checkpoint": (tuckerl.Checkpoint, [3, b"a", None], "path must be a path"),
    "CsvLog": (tuckerl.CsvLog, [0.5, ["a"]], "path must be a path"),
    "JsonLinesLog": (tuckerl.JsonLinesLog, [0, "\0", "\ud800"], "path must"),
    "TensorBoard": (tuckerl.TensorBoard, [0, {}], "folder must be a path"),
    "Evaluate": (lambda v: tuckerl.Evaluate(best=v), [0, np.ones(2)], "best must be a path"),
    "save": (lambda v: learner().save(v), [None, 1, "a\0"], "path must"),
    "Learner.load": (tuckerl.QLearning.load, [None, b"a"], "path must be a path"),
    "load": (tuckerl.load, [None, (1, 2)], "path must be a path"),
    "evaluate_saved": (lambda v: learner().evaluate_saved(v), [None, len], "path must be a path"),
    "restore": (lambda v: learner().restore(v), [None, [1]], r"restore\(\) takes what load\(\) has read"),
    "change": (lambda v: learner().change(v), [None, [1], np.ones(2)], "changes must be a mapping"),
    "change to what there is not": (lambda v: learner().change({"lr": v}), [1], "no parameter 'lr': use alpha"),
    "Linear.values": (tuckerl.Linear(1, 0, 3).values, [-1, [3], None, len], "n_episodes must be a whole number"),
    "Harmonic.values": (tuckerl.Harmonic(1, 3).values, ["3", 2.0], "n_episodes must be a whole number"),
    "too many values": (tuckerl.Exponential(1).values, [10**15, 10**30], "a schedule would take"),
    "OwnDistribution": (OwnDistribution, [None, 3, b"x"], "name must be text"),
    "the decay of a schedule": (
        lambda v: tuckerl.EpsilonGreedy(tuckerl.Linear(1, 0, 3), v),
        [np.ones(2), "1", 0.5],
        "epsilon_decay must be a number in|epsilon is a schedule already",
    ),
    "decay beside a policy": (
        lambda v: tuckerl.QLearning(mdp(), policy=tuckerl.Greedy(), epsilon_decay=v),
        [np.ones(2), None, 0.5],
        "epsilon_decay must be a number in|epsilon belongs to the default policy",
    ),
    "its decay": (lambda v: OwnDistribution("x", decay=v), [1j, "1", 2], "decay must be a number in"),
    "an environment's class": (
        tuckerl.QLearning,
        [tuckerl.TabularMDP, lambda x: x, type],
        r"a callable that makes .* must take \(\)",
    ),
    "an environment without spaces": (tuckerl.QLearning, [gymnasium.Env, gymnasium.Env()], "has no observation_space"),
    "agents without spaces": (
        tuckerl.QLearning,
        [WithoutSpaces, WithoutSpaces()],
        "has no spaces of its agent 'a'",
    ),
    "and joined": (tuckerl.JointEnv, [WithoutSpaces()], "has no spaces of its agent 'a'"),
    "and to be split": (tuckerl.SplitEnv, [gymnasium.Env()], "Env has no observation_space: set it in"),
    "quantile_edges": (lambda v: tuckerl.quantile_edges(v, 2), [lambda x: x], r"must take \(\); got"),
    "layout": (
        lambda v: of_table(layout=v),
        [3, "ab", (1,), iter([1, 1]), range(10**30)],
        r"layout must be \(rows, columns\)",
    ),
    "action_names": (lambda v: of_table(action_names=v), [3, "a", ("a",), iter("ab")], "action_names must be 2 names"),
    "state_factors": (lambda v: of_table(state_factors=v), [1, [1], [("a",)], ["a1"]], "state_factors must be pairs"),
    "arrays": (
        lambda v: tuckerl.TabularMDP(v, [[0.0]], [[True]]),
        [[[0], [0, 0]], range(10**18)],
        "next_state must be one array",
    ),
    "action_weights": (tuckerl.action_weights, ["x", [[1], [1, 2]], [[1j]], None], "action_factor must be an"),
    "Maze.state": (MAZE.state, [0.5, (1,), (9, 9), "ab"], "cell('s row)? must"),
    "Maze.cell": (MAZE.cell, [-1, 54, 0.5, "a", np.ma.masked], "state must be a whole number from 0 to 53"),
    "learn": (lambda v: learner().learn(v, steps=v), [HUGE], "either episodes or steps; got about 10"),
    "a huge layout": (lambda v: of_table(layout=v), [(HUGE, 1)], "layout must be .*got .about 10"),
    "start": (lambda v: tuckerl.Maze(np.zeros((2, 2), bool), v, (1, 1)), [(HUGE, 0), (0, HUGE)], "got .*about 10"),
    "walls": (lambda v: tuckerl.Maze(v, (0, 0), (1, 1)), [range(10**18), [[1], [1, 2]]], "walls must be"),
    "unfold": (lambda v: tuckerl.unfold(v, 0), [3, None, [[1], [1, 2]]], "(X|a tensor) must"),
    "fold": (lambda v: tuckerl.fold(np.ones((2, 2)), 0, v), [3, "ab", (2, 0.5), (2, -2)], "(each of )?shape must be"),
    "mode_product": (lambda v: tuckerl.mode_product(X, v, 0), [[["a"] * 4], [[1], [1, 2]]], "matrix .*must"),
    "ranks": (lambda v: tuckerl.tucker(X, v), [3, "abcd", {1, 2, 3, 4}, (1, 1)], "ranks must be 4 whole numbers"),
    "weights": (
        lambda v: tuckerl.TensorStep(2, (1, 1, 1, 1), v),
        [lambda: 0, lambda a, b: 0],
        r"weights must take \(decomp",
    ),
    "share": (lambda v: tuckerl.TensorStep(2, (1, 1, 1, 1), share=v), [lambda: 0], r"share must take \(context\)"),
    "callbacks": (
        lambda v: learner().learn(1, callbacks=v),
        [3, "ab", print, {1}, np.broadcast_to(0.5, 10**12)],
        "callbacks must be a sequence",
    ),
    "where to judge": (
        lambda v: learner().evaluate(1, env=v),
        [tuckerl.QLearning, lambda x: x],
        r"must take \(\); got",
    ),
    "what a callable makes": (
        lambda v: learner().evaluate(1, env=v),
        [mdp, lambda: 3],
        "the callable must make a Gymnasium environment",
    ),
    "names that are no text": (lambda v: learner().change(v), [{1: 2}, {1: 2, "a": 3}, {None: 1}], "no parameter"),
    "bins of another number": (
        lambda v: space_encoder(gymnasium.spaces.Box(0, 1, (2,)), [v]),
        [HUGE, nested(5000)],
        "one entry for each of 2 dimensions; got 1: a list",
    ),
    "what a space is called": (
        lambda v: space_encoder(gymnasium.spaces.Discrete(2), what=v),
        [3, nested(5000)],
        "what must be text",
    ),
    "a product out of range": (
        lambda v: tuckerl.mode_product(X, v, 0),
        [np.full((1, 4), 1.7e308)],
        "leaves the range of floats",
    ),
    "a callback": (lambda v: learner().learn(1, callbacks=[v]), [lambda: 0], r"a callback must take \(learner\)"),
    "progress": (lambda v: learner().learn(1, progress=v), [1, "no", np.ones(2)], "progress must be True or False"),
    "huge views": (
        lambda v: tuckerl.Maze(np.broadcast_to(v, (10**6, 10**6)), (0, 0), (1, 1)),
        [False],
        r"would take 1,000,000,000,000 bytes .* smaller",
    ),
    "huge factors": (
        tuckerl.action_weights,
        [np.broadcast_to(0.5, (10**6, 10**6))],
        "would take 8,000,000,000,000 bytes",
    ),
    "kernel": (tuckerl.kernel, [3, gymnasium.Env, len], "a kernel must be a Python function"),
    "compiled": (lambda v: tuckerl.QLearning(mdp(), compiled=v), [np.zeros(0), np.zeros(2)], "compiled must be"),
    "team_reward": (lambda v: tuckerl.TeamQ(mdp(), team_reward=v), [np.zeros(2)], "team_reward is for PettingZoo"),
    "JointEnv": (lambda v: tuckerl.JointEnv(RobotRescueEnv(), v), [np.zeros(0), ["mean"]], "reward must be one of"),
    "SplitEnv": (
        lambda v: tuckerl.SplitEnv(tuckerl.JointEnv(RobotRescueEnv()), v),
        [3, [[], []], "ab"],
        "agents must be 2",
    ),
    "actions": (begun(RobotRescueEnv()).step, [3, None, [1, 2], True], "actions must name robot_0 and robot_1"),
    "inspect_learner": (inspect_learner, [None, mdp()], "learner must be one of tuckerl's"),
    "title": (lambda v: inspect_learner(learner(), title=v), [3, np.ones(2)], "title must be text"),
    "title of a tensor": (lambda v: inspect_tensor(X, (1, 1, 1, 1), title=v), [b"x"], "title must be text"),
    "tables": (
        lambda v: inspect_tensor(v, (1, 1, 1, 1)),
        [[[1], [1, 2]], np.full((1, 1, 1, 1), "a")],
        "tensor of Q-tables",
    ),
    "blocked": (lambda v: inspect_tensor(X, (1, 1, 1, 1), blocked=v), [np.ones(4), [[1], [1, 2]]], "blocked must be 4"),
    "inspection_figures": (inspection_figures, [None, "x"], "inspection must be what inspect_learner returns"),
    "write_inspection": (lambda v: write_inspection(v, Path("page")), [b"x"], "inspection must be what"),
    "rewards that leave the range": (lambda v: robot_rescue(grip_reward=v), [1e308], "reward must be finite everyw"),
    "numbers of thousands of digits": (lambda v: mdp().with_time_limit(v), [-HUGE], "got about 10"),
    "and of bins": (lambda v: space_encoder(gymnasium.spaces.Discrete(2), v), [HUGE], "bins must be None; got about"),
}


@pytest.mark.filterwarnings("ignore:Your environment should override:UserWarning")  # as PettingZoo says
@pytest.mark.parametrize("place", WRONG)
def test_odd_arguments_are_named(place: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    call, values, message = WRONG[place]
    for value in values:
        with pytest.raises(errors.TuckerlError, match=message) as refused:
            call(value)
        assert len(str(refused.value)) <= errors.LONGEST_MESSAGE
    assert not list(tmp_path.iterdir())


class Unspeakable:
    """What cannot be shown."""

    def __repr__(self) -> str:
        raise RuntimeError("no words")


LONG = "a" * 10_000
QLEARNING: Any = tuckerl.QLearning
WIDE = [np.zeros(10_000), list(range(10_000)), {"a": "b\n" * 5000}, HUGE, Unspeakable(), LONG]


class Answering(gymnasium.Wrapper[Any, Any, Any, Any]):
    """A frozen lake that answers a step with something else, at one place."""

    def __init__(self, place: int, answer: Any) -> None:
        super().__init__(gymnasium.make("FrozenLake-v1"))
        self.place, self.answer = place, answer

    def step(self, action: Any) -> Any:
        result = super().step(action)
        return *result[: self.place], self.answer, *result[self.place + 1 :]


SHOWING: dict[str, tuple[Callable[[Any], Any], list[Any]]] = {
    **{f"{place} of a step": (partial(lambda i, v: check_problem(Answering(i, v)), place), WIDE) for place in range(5)},
    "check_learner": (check_learner, WIDE),
    "environment": (tuckerl.QLearning, [LONG, f"{LONG}:Env-v0"]),
    "its keywords": (lambda v: make_environment("FrozenLake-v1", {"map_name": v, "is_slippery": v}), WIDE[:3]),
    "keyword": (lambda v: QLEARNING(mdp(), **{v: 1}), [LONG]),
    "keyword of learn": (lambda v: QLEARNING.learn(learner(), 1, **{v: 1}), [LONG]),
    "attribute": (lambda v: setattr(learner(), v, 1), [LONG]),
    "policy": (lambda v: tuckerl.QLearning(mdp(), policy=v), WIDE),
    "name": (lambda v: DeclaredArray(v, "none"), [LONG + "-", *WIDE[:-1]]),
    "bounds": (lambda v: DeclaredArray("a", "none", bounds=v), [LONG]),
    "settings": (lambda v: parse_settings([v]), [LONG]),
    "numbers": (lambda v: parse_numbers(v, "--ranks"), [LONG]),
    "variant": (lambda v: variant(cart_pole.CART_POLE.algorithm, v), [LONG]),
    "member of a file": (lambda v: checked_json({v: 1}, _Named, "it"), [LONG]),
}


class _Named(TypedDict):
    known: int


@pytest.mark.parametrize("place", SHOWING)
def test_of_what_is_long_or_cannot_be_shown_a_message_shows_the_beginning(place: str) -> None:
    call, values = SHOWING[place]
    for value in values:
        with pytest.raises(errors.TuckerlError) as refused:
            call(value)
        said = str(refused.value)
        assert " ... " not in said  # nothing was left out of the message itself
        assert "\n" not in said


def test_a_view_of_a_million_rows_is_refused_at_once() -> None:
    begun_at = time.process_time()
    with pytest.raises(errors.ParameterError, match="got 1000000: array"):
        MAZE.state(np.broadcast_to(0.5, (10**6, 10**6)))  # type: ignore[arg-type]  # it is no cell
    assert time.process_time() - begun_at < 0.1


def test_a_refused_change_changes_nothing() -> None:
    agent = learner()
    with pytest.raises(errors.ParameterTypeError):
        agent.change({"alpha": 0.5, "lr": 1})
    assert agent.alpha == 0.1
    agent.change({"alpha": 0.5})
    assert agent.alpha == 0.5


def test_text_of_another_class_is_kept_as_plain_text(tmp_path: Path) -> None:
    class Text(str):
        __slots__ = ()

    agent = learner()
    agent.ties = Text("first")
    agent.save(tmp_path / "agent")
    assert tuckerl.QLearning.load(tmp_path / "agent").ties == "first"


def test_a_deviation_of_minus_zero_is_zero() -> None:
    np.testing.assert_array_equal(tuckerl.random_maze(4, 4, -0.0, goal=(3, 3)).walls, np.zeros((4, 4), dtype=np.bool_))


def test_half_of_next_to_nothing_is_nothing() -> None:
    np.testing.assert_array_equal(
        tuckerl.Harmonic(1.0, 5e-324).values(3), [1.0, 0.0, 0.0]
    )  # and NumPy warns of nothing


def test_the_command_line_shortens_what_it_repeats(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        cli.main(["train", "sarsa", "FrozenLake-v1", "--episodes", "9" * 10_000])
    assert end.value.code == 2
    assert len(capsys.readouterr().err) <= errors.LONGEST_MESSAGE + 20
