"""Learners that are judged elsewhere: on recorded, altered and shown environments, which stay their owner's."""

import warnings
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

from tests.adapters.parallel_worlds import Leaving, Masked
from tests.learners.stepped_worlds import SeededTableEnv, TableEnv
from tests.learners.worlds import corridor, random_mdp
from tuckerl import Evaluate, JointEnv, QLearning, TeamQ
from tuckerl.errors import EnvironmentFaultError, ParameterError, ParameterTypeError, StepCapWarning

RIGHT = np.tile([0.0, 1.0], (5, 1))


def going_right(env: Any = None) -> Any:
    return QLearning(corridor() if env is None else env, initial_q=RIGHT, seed=1)


class Watched(TableEnv):
    """The corridor, which counts what is done to it."""

    def __init__(self, render_mode: str | None = None) -> None:
        super().__init__(corridor())
        self.render_mode = render_mode
        self.seeds: list[int | None] = []
        self.closed, self.rendered, self.stepped = 0, 0, 0

    def reset(self, *, seed: int | None = None, options: Any = None) -> Any:
        self.seeds.append(seed)
        return super().reset(seed=seed)

    def step(self, action: int) -> Any:
        self.stepped += 1
        return super().step(action)

    def render(self) -> Any:
        self.rendered += 1
        return "here"

    def close(self) -> None:
        self.closed += 1


class Stuck(Watched):
    """Cannot be closed, as some environments cannot that were never rendered."""

    def close(self) -> None:
        raise AttributeError("no renderer")


class Drawn(Leaving):
    """Leaving, which keeps when it was rendered."""

    def __init__(self) -> None:
        super().__init__()
        self.drawn: list[int] = []

    def render(self) -> str:
        self.drawn.append(self.clock)
        return super().render()


def test_an_environment_of_the_users_is_the_one_that_is_stepped_and_stays_open() -> None:
    env = Watched()
    result = going_right().evaluate(4, env=gymnasium.wrappers.TimeLimit(env, 50), seed=3)
    assert result.returns.tolist() == [[-5.0]] * 4
    assert result.steps.tolist() == [[5]] * 4
    assert (env.stepped, env.closed) == (20, 0)
    assert len(env.seeds) == 4, "an episode for each evaluated one, none to try it out"
    assert env.seeds[0] is not None


def test_what_was_made_for_an_evaluation_is_closed() -> None:
    made: list[Watched] = []

    def make() -> Watched:
        made.append(Watched())
        return made[-1]

    assert going_right().evaluate(2, env=make).mean == -5.0
    assert [env.closed for env in made] == [1]


def test_a_recorded_environment_has_all_episodes() -> None:
    recorded = gymnasium.wrappers.RecordEpisodeStatistics(gymnasium.wrappers.TimeLimit(TableEnv(corridor()), 50))
    result = going_right().evaluate(7, env=recorded)
    assert list(recorded.return_queue) == result.returns[:, 0].tolist()
    assert list(recorded.length_queue) == result.steps[:, 0].tolist()


def test_an_altered_environment_is_judged_as_it_is() -> None:
    doubled = gymnasium.wrappers.TransformReward(TableEnv(corridor()), lambda reward: 2 * float(reward))
    for env in (corridor(), TableEnv(corridor())):
        agent = going_right(env)
        assert agent.evaluate(2, env=doubled).mean == -10.0
        assert agent.evaluate(2, env=corridor(limit=3)).steps.tolist() == [[3], [3]]
        assert agent.evaluate(2).mean == -5.0


def test_judging_elsewhere_leaves_learning_alone() -> None:
    mdp = random_mdp(4, n_outcomes=3, random_start=True)
    looked, other = (QLearning(SeededTableEnv(mdp), seed=2) for _ in range(2))
    for _ in range(2):
        looked.learn(4)
        looked.evaluate(5, env=SeededTableEnv(mdp))
        other.learn(4)
    np.testing.assert_array_equal(looked.q, other.q)


def test_bins_go_along() -> None:
    agent = QLearning("CartPole-v1", bins=[1, 1, 3, [0.0]], seed=0).learn(episodes=3)
    elsewhere = agent.evaluate(5, env=gymnasium.make("CartPole-v1"), seed=4)
    np.testing.assert_array_equal(elsewhere.returns, agent.evaluate(5, seed=4).returns)


@pytest.mark.parametrize(
    "env",
    [random_mdp(4), TableEnv(random_mdp(4)), "CartPole-v1", "Blackjack-v1"],
    ids=["arrays", "instance", "box", "id"],
)
def test_other_spaces_are_refused(env: Any) -> None:
    with pytest.raises(ParameterError, match="env must have the spaces of the one that was learned"):
        going_right().evaluate(1, env=env)


def test_all_agents_are_judged() -> None:
    independent = QLearning(Leaving(), seed=3)
    result = independent.evaluate(4, env=Leaving())
    assert result.returns.tolist() == [[1.0, 20.0, 300.0]] * 4
    assert result.steps.tolist() == [[1, 2, 3]] * 4
    team = TeamQ(Masked(), seed=0, epsilon=0.5).learn(30)
    for env in (Masked(), JointEnv(Masked())):
        assert team.evaluate(5, env=env).returns.min() >= 0, "the masks of the other environment hold"
    rescue = TeamQ("tuckerl/RobotRescue-v0", seed=0)  # on its extracted table
    assert rescue.evaluate(1, env="tuckerl/RobotRescue-v0").steps.tolist() == [[1000]]
    with pytest.raises(ParameterError, match="spaces of the one that was learned"):
        independent.evaluate(1, env=Masked())


def test_a_seed_of_the_learners_own_replays_nothing_that_was_learned() -> None:
    mdp = random_mdp(4, n_outcomes=3, random_start=True)
    for env in (mdp, SeededTableEnv(mdp)):
        learned = QLearning(env, epsilon=1.0, seed=7).learn(20)
        played = QLearning(env, epsilon=1.0, seed=7).evaluate(20, deterministic=False, seed=7)
        assert not np.array_equal(played.returns, learned.returns)


@pytest.mark.parametrize("make", [Stuck, Stuck()], ids=["callable", "instance"])
def test_results_survive_an_environment_that_cannot_be_closed(make: Any) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)  # one that is made to be compared is closed, too
        agent = going_right(make)
    with pytest.warns(ResourceWarning, match=r"Stuck failed to close \(AttributeError: no renderer\)"):
        assert agent.evaluate(3).mean == -5.0
    assert agent.learn(1).episodes == 1
    assert agent.evaluate(1, env=Stuck()).mean == -5.0


def test_faults_of_another_environment_are_its_own() -> None:
    class Broken(Watched):
        def step(self, action: int) -> Any:
            raise RuntimeError("worn out")

    agent = going_right()
    with pytest.raises(EnvironmentFaultError, match=r"Broken failed \(RuntimeError: worn out\)"):
        agent.evaluate(2, env=Broken())
    assert agent.learn(1).episodes == 1


# Showing


def test_every_step_is_rendered() -> None:
    env = Watched("ansi")
    going_right().evaluate(2, env=env, render=True)
    assert env.rendered == 2 * (1 + 5)
    shows_itself = Watched("human")
    going_right().evaluate(2, env=shows_itself, render=True)
    assert (shows_itself.rendered, shows_itself.stepped) == (0, 10)
    world = Drawn()
    QLearning(Leaving(), seed=3).evaluate(1, env=world, render=True)
    assert world.drawn == [0, 1, 2, 3]


def test_an_environment_known_by_its_id_is_made_again_to_be_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[Any] = []

    def make(name: str, keywords: Any) -> Any:
        made.append((name, keywords))
        return Watched("human")

    monkeypatch.setattr("tuckerl.adapters.judging.make_environment", make)
    agent = going_right(TableEnv(corridor()))
    vars(agent)["problem"] = agent.problem.with_source("corridor", id="Corridor-v0")
    assert agent.evaluate(1, render=True).mean == -5.0
    assert made == [("Corridor-v0", {"render_mode": "human"})]


@pytest.mark.parametrize(
    "parameters",
    [{}, {"env": Watched()}, {"env": corridor()}, {"env": Watched}],
    ids=["compiled", "instance", "problem", "class"],
)
def test_what_cannot_be_shown_says_so(parameters: Any) -> None:
    for learned in (corridor(), Watched()):
        with pytest.raises(ParameterError, match=r"pass env=gymnasium.make\(..., render_mode='human'\)"):
            going_right(learned).evaluate(1, render=True, **parameters)
    with pytest.raises(ParameterTypeError, match="render must be True or False"):
        going_right().evaluate(1, render="human")


# Warnings


def test_warnings_point_to_the_line_that_called() -> None:
    left = np.tile([1.0, 0.0], (5, 1))
    circling = QLearning(TableEnv(corridor(limit=None)), initial_q=left, alpha=1e-9, epsilon=0.0, seed=1)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        circling.evaluate(1)
        circling.learn(1, callbacks=[Evaluate(1, every=1)])
    capped = [one for one in caught if issubclass(one.category, StepCapWarning)]
    assert len(capped) == 3, "of an evaluation, of learning, and of an evaluation while learning"
    assert {Path(one.filename).name for one in capped} == {Path(__file__).name}


# Stable-Baselines3's own loop


class Batches:
    """Several environments at once, as Stable-Baselines3 steps them: each begins anew where its episode ends."""

    def __init__(self, makes: list[Any]) -> None:
        self.envs = [make() for make in makes]
        self.num_envs = len(makes)

    def reset(self) -> Any:
        return self._batch([env.reset(seed=i)[0] for i, env in enumerate(self.envs)])

    def step(self, actions: Any) -> Any:
        seen, rewards, dones = [], [], []
        for env, action in zip(self.envs, actions, strict=True):
            observation, reward, terminated, truncated, _ = env.step(action)
            seen.append(env.reset()[0] if terminated or truncated else observation)
            rewards.append(reward)
            dones.append(terminated or truncated)
        return self._batch(seen), np.array(rewards), np.array(dones), [{}] * self.num_envs

    def _batch(self, seen: list[Any]) -> Any:
        if isinstance(seen[0], dict):
            return {key: np.stack([one[key] for one in seen]) for key in seen[0]}
        return np.stack(seen)


def returns_of(model: Any, env: Batches, n_eval_episodes: int, **more: Any) -> list[float]:
    """Return what Stable-Baselines3's ``evaluate_policy`` would: the loop is its."""
    returns: list[float] = []
    totals, states = np.zeros(env.num_envs), None
    observations, starts = env.reset(), np.ones(env.num_envs, dtype=bool)
    while len(returns) < n_eval_episodes:
        actions, states = model.predict(
            observations, state=states, episode_start=starts, deterministic=True, **{k: v() for k, v in more.items()}
        )
        observations, rewards, starts, _ = env.step(actions)
        totals += rewards
        returns += totals[starts].tolist()
        totals[starts] = 0.0
    return returns


class Beside(gymnasium.Env[Any, Any]):
    """Three steps; the mask beside the observation allows one action of four, which pays 1."""

    observation_space = spaces.Dict({"observation": spaces.Discrete(3), "action_mask": spaces.MultiBinary(4)})
    action_space = spaces.Discrete(4)

    def reset(self, *, seed: int | None = None, options: Any = None) -> Any:
        super().reset(seed=seed)
        self.n_steps = 0
        return self._seen(), {}

    def _seen(self) -> Any:
        self.right = int(self.np_random.integers(4))
        return {"observation": np.int64(0), "action_mask": (np.arange(4) == self.right).astype(np.int8)}

    def step(self, action: Any) -> Any:
        self.n_steps += 1
        reward = float(action == self.right)
        return self._seen(), reward, self.n_steps == 3, False, {}

    def action_masks(self) -> Any:
        return np.arange(4) == self.right


def test_the_loop_of_stable_baselines_plays_a_learner() -> None:
    plain = Batches([lambda: TableEnv(corridor())] * 3)
    assert set(returns_of(going_right(), plain, 7)) == {-5.0}
    agent = QLearning(Beside(), seed=0).learn(episodes=2)
    assert set(returns_of(agent, Batches([Beside] * 3), 9)) == {3.0}
    # sb3-contrib asks the environments for their masks.
    env = Batches([Beside] * 3)
    masks = {"action_masks": lambda: np.stack([one.action_masks() for one in env.envs])}
    assert set(returns_of(agent, env, 9, **masks)) == {3.0}
