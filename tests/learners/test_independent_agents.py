"""Independent learners: every agent of a PettingZoo environment has a table of its own."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gymnasium import spaces

from tests.adapters.parallel_worlds import Breaking, Dice, Leaving, Masked, MaskedInObservation, Meeting, Unequal, World
from tests.reference import tensor_step
from tests.reference.independent_agents import Game, SpaceEncoder
from tests.training.test_resume import assert_same
from tuckerl import DynaH, QLearning, Sarsa, SarsaLambda, TensorStep
from tuckerl.adapters.pettingzoo_problem import PettingZooProblem
from tuckerl.errors import EnvironmentFaultError, ObservationError, ParameterError, ProblemError

UNEQUAL = SpaceEncoder(
    lambda agent, seen: int(seen) + 1 if agent == "scout" else int(seen[0]) * 2 + int(seen[1]),
    lambda agent, a: a - 1 if agent == "scout" else np.array([a // 4, a % 4]),
    {"scout": (4, 3), "carrier": (4, 8)},
)
WORLDS: dict[str, tuple[Any, SpaceEncoder | None]] = {
    "meeting": (Meeting, None),
    "leaving": (Leaving, None),
    "truncated": (lambda: Leaving((2, 1, 3), truncated=("a", "c"), both=("c",)), None),
    "unequal": (Unequal, UNEQUAL),
    "masked": (Masked, None),
    "masked, the first leaves": (lambda: Masked(first=2, truncated=True), None),
    "masks in observations": (MaskedInObservation, SpaceEncoder(lambda a, seen: int(seen), lambda a, act: act, {})),
    "dice": (Dice, None),
}
SIZES = {"first": (5, 3), "second": (5, 3)}
EPISODES = 12
STEP = TensorStep(every=4, ranks=(3, 2, 2, 2), floor=0.1)


def game_of(world: str, **numbers: Any) -> Game:
    make, encoder = WORLDS[world]
    if encoder is not None and not encoder.sizes:
        encoder = encoder._replace(sizes=SIZES)
    return Game(make(), encoder=encoder, **numbers)


@pytest.mark.parametrize("world", WORLDS)
@pytest.mark.parametrize("sarsa", [False, True])
def test_forced_actions_equal_the_twin(world: str, sarsa: bool) -> None:
    learner = (Sarsa if sarsa else QLearning)(WORLDS[world][0](), seed=6, alpha=0.3, epsilon=1.0).learn(EPISODES)
    game = game_of(world, seed=6, sarsa=sarsa, alpha=0.3, gamma=0.95, epsilon=1.0, decay=1.0, ties="random")
    played = [game.episode(np.ones(8)) for _ in range(EPISODES)]
    assert isinstance(learner.problem, PettingZooProblem)
    assert learner.n_agents == len(game.agents)
    assert learner.q.shape == (len(game.agents), learner.problem.n_states, learner.problem.n_actions)
    for place, (name, agent) in enumerate(game.agents.items()):
        assert learner.steps[:, place].tolist() == [done[name][0] for done in played]
        np.testing.assert_allclose(learner.returns[:, place], [done[name][1] for done in played], rtol=1e-12)
        np.testing.assert_allclose(learner.q[place], agent.q, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("world", ["meeting", "leaving", "masked"])
def test_greedy_actions_and_decay_equal_the_twin(world: str) -> None:
    # Halves of small whole numbers, five episodes: no sum rounds.
    numbers: dict[str, Any] = {"alpha": 0.5, "gamma": 0.5, "epsilon": 0.5}
    learner = QLearning(WORLDS[world][0](), seed=2, epsilon_decay=0.75, **numbers).learn(5)
    game = game_of(world, seed=2, decay=0.75, ties="random", **numbers)
    played = [game.episode(np.ones(3)) for _ in range(5)]
    assert learner.returns.tolist() == [[done[name][1] for name in game.agents] for done in played]
    for place, agent in enumerate(game.agents.values()):
        np.testing.assert_array_equal(learner.q[place], agent.q)


@pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")
@pytest.mark.parametrize("share", ["max", "min", "best", "random", "mean", "none"])
@pytest.mark.parametrize("world", ["meeting", "leaving", "dice"])
@pytest.mark.parametrize("sarsa", [False, True])
def test_a_tensor_step_over_the_agents_tables_equals_its_twin(share: str, world: str, sarsa: bool) -> None:
    step = TensorStep(every=4, ranks=(3, 2, 2, 2), share=share, floor=0.1)
    env = WORLDS[world][0]()
    learner = (Sarsa if sarsa else QLearning)(env, seed=6, alpha=0.3, epsilon=1.0, tensor_step=step).learn(10)
    game = game_of(world, seed=6, sarsa=sarsa, alpha=0.3, gamma=0.95, epsilon=1.0, decay=1.0, ties="random")
    agents = list(game.agents.values())
    steps, windows = tensor_step.play(
        agents, 10, seed=6, every=4, ranks=(3, 2, 2, 2), sharing=share, floor=0.1, weights="paper"
    )
    assert learner.steps.tolist() == steps
    assert learner.tensor_step_history.chosen.tolist() == [window.chosen for window in windows]
    np.testing.assert_allclose(
        learner.tensor_step_history.weights, [window.omega for window in windows], rtol=0, atol=1e-9
    )
    for place, agent in enumerate(agents):
        np.testing.assert_allclose(learner.q[place], agent.q, rtol=1e-8, atol=1e-9)


LEARNERS: dict[str, tuple[Any, dict[str, Any]]] = {
    "q-learning": (QLearning, {}),
    "sarsa-lambda": (SarsaLambda, {"trace": "accumulating", "carry_trace": True, "alpha": 0.05}),
    "dyna-h": (DynaH, {"heuristic": np.arange(4.0), "planning_steps": 3}),
}
LOOPS = ("sarsa-lambda", "dyna-h")  # each compiles a loop of its own, for half a minute
QUICK_AND_LONG = [pytest.param(name, marks=pytest.mark.long) if name in LOOPS else name for name in LEARNERS]


@pytest.mark.parametrize("name", QUICK_AND_LONG)
def test_places_that_an_agent_has_not_got_are_never_used(name: str) -> None:
    made, parameters = LEARNERS[name]
    learner = made(Unequal(), initial_q=7.0, epsilon=0.5, seed=3, **parameters).learn(40)
    assert learner.q.shape == (2, 4, 8)
    assert (learner.q[0, :, 3:] == 7.0).all(), "the scout has three actions"
    assert (learner.q[0, :3, :3] != 7.0).any()
    for deterministic in (None, True, False):
        for _ in range(20):
            actions, _ = learner.predict({"scout": -1, "carrier": np.array([0, 0])}, deterministic=deterministic)
            assert actions["scout"] in (-1, 0, 1)
            assert actions["carrier"].tolist() in [[i, j] for i in range(2) for j in range(4)]


@pytest.mark.parametrize("world", [Masked, MaskedInObservation])
@pytest.mark.parametrize("made", [QLearning, Sarsa, SarsaLambda])
def test_forbidden_actions_are_never_taken(made: Any, world: Any) -> None:
    learner = made(world(), initial_q=2.0, seed=3, epsilon=0.5).learn(40)
    assert learner.returns.min() >= 0, "what is forbidden costs 100"
    assert learner.evaluate(5).returns.min() >= 0
    for clock in range(4):
        assert learner.q[0, clock, clock % 3] == 2.0
        assert learner.q[1, clock, (clock + 1) % 3] == 2.0
    seen = {"first": world().reset()[0]["first"]}
    assert learner.predict(seen)[0]["first"] != 0


def test_what_cannot_be_shared_is_refused() -> None:
    with pytest.raises(ParameterError, match=r"n_agents must stay 1 where each of the environment's 2 agents .* got 2"):
        QLearning(Meeting(), n_agents=2)
    with pytest.raises(ProblemError, match=r"a tensor step needs agents whose .* equal spaces"):
        QLearning(Unequal(), tensor_step=STEP)


def test_predictions_and_evaluations_are_by_agent() -> None:
    learner = QLearning(Meeting(), seed=1, alpha=0.5, initial_q=5.0).learn(200)
    actions, nothing = learner.predict({"west": 0, "east": 4})
    assert nothing is None
    assert actions["west"] in (0, 1, 2)
    assert list(learner.predict({"east": 4})[0]) == ["east"]
    evaluation = learner.evaluate(4)
    assert evaluation.returns.shape == evaluation.steps.shape == (4, 2)
    assert evaluation.returns.tolist() == [[8.0, 8.0]] * 4, "two steps each: -1 and 9"
    assert (evaluation.mean, evaluation.low, evaluation.high) == (8.0, 8.0, 8.0)
    for wrong in (0, {"north": 0}, [0, 4]):
        with pytest.raises(ObservationError, match="observations must be a dict by agent, of west, east; got"):
            learner.predict(wrong)
    with pytest.raises(ObservationError, match="observation of west must be a whole number from 0 to 4"):
        learner.predict({"west": 9})


def test_an_evaluation_leaves_learning_alone() -> None:
    looked, other = (QLearning(Dice(), seed=4) for _ in range(2))
    for _ in range(3):
        looked.learn(2)
        looked.evaluate(2)
        other.learn(2)
    assert_same(looked, other)


@pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")
@pytest.mark.parametrize("step", [None, STEP])
@pytest.mark.parametrize("world", ["leaving", "masked", "dice"])
@pytest.mark.parametrize("name", QUICK_AND_LONG)
def test_going_on_equals_never_having_stopped(name: str, world: str, step: Any, tmp_path: Path) -> None:
    made, parameters = LEARNERS[name]
    if name == "dyna-h":
        parameters = parameters | {"heuristic": np.arange(float(QLearning(WORLDS[world][0]()).problem.n_states))}

    def fresh() -> Any:
        return made(WORLDS[world][0](), tensor_step=step, seed=9, epsilon=0.3, **parameters)

    learner = fresh()
    for piece in (3, 3, 4):
        learner.save(tmp_path / "agent")
        learner = made.load(tmp_path / "agent", env=WORLDS[world][0]()).learn(piece)
    assert_same(learner, fresh().learn(10))


def test_files_know_their_agents(tmp_path: Path) -> None:
    path = tmp_path / "agent"
    QLearning(Meeting(), seed=1).learn(2).save(path)
    turned = Meeting()
    turned.possible_agents.reverse()
    with pytest.raises(ParameterError, match="saved with: agents was west, east; got east, west"):
        QLearning.load(path, env=turned)
    with pytest.raises(ParameterError, match=r"env must be the one that .* was saved with"):
        QLearning.load(path, env=Dice())
    QLearning("tuckerl/RobotRescue-v0", seed=1).learn(1).save(path)
    again = QLearning.load(path).learn(1)
    assert_same(again, QLearning("tuckerl/RobotRescue-v0", seed=1).learn(2))


class Weather(World):
    """The guard sees a number and the pilot the wind, by a Box; so does the cook, who sees nothing new."""

    def __init__(self) -> None:
        sight = {"guard": spaces.Discrete(5), "pilot": spaces.Box(-1.0, 1.0, (1,)), "cook": spaces.Discrete(5)}
        super().__init__(sight, {agent: spaces.Discrete(2) for agent in sight})

    def observe(self, agent: str) -> Any:
        return np.array([self.clock / 2 - 1], dtype=np.float32) if agent == "pilot" else np.int64(self.clock)

    def act(self, actions: dict[str, Any]) -> tuple[dict[str, float], set[str], set[str]]:
        late = set(actions) if self.clock == 4 else set()
        return {agent: 1.0 + action for agent, action in actions.items()}, set(), late


def test_bins_of_some_agents_survive_a_file(tmp_path: Path) -> None:
    bins = {"pilot": [[-0.5, 0.75]]}
    learner = QLearning(Weather(), bins=bins, seed=1, epsilon=1.0).learn(6)
    assert (learner.q[1, :2] != 0).any(axis=1).all(), "the wind is -1, then -0.5, 0 and 0.5"
    assert not learner.q[1, 2:].any(), "and at last 1, where nobody acts"
    assert (learner.q[2] != 0).any(axis=1).tolist() == [True] * 4 + [False]
    learner.save(tmp_path / "agent")
    again = QLearning.load(tmp_path / "agent", env=Weather())
    assert_same(again.learn(4), learner.learn(4))
    assert again.predict({"pilot": np.array([-0.9])}) == learner.predict({"pilot": np.array([-0.9])})
    assert QLearning(Weather(), bins=7).problem.n_states == 7
    with pytest.raises(ParameterError, match="has no Box to cut into bins"):
        QLearning(Meeting(), bins=7)


def test_what_an_error_breaks_off_is_undone_and_played_again() -> None:
    learner = QLearning(Breaking(), seed=3, epsilon=1.0, alpha=0.3)
    for _ in range(3):
        with pytest.raises(EnvironmentFaultError, match=r"Breaking failed \(RuntimeError: the .* episode 0 of"):
            learner.learn(2)
    assert learner.episodes == 0
    assert not learner.q.any()
    learner._state.worlds[0].env.at = 99  # type: ignore[attr-defined]  # Python steps this world
    assert learner.learn(2).steps.tolist() == [[9, 9], [9, 9]]
