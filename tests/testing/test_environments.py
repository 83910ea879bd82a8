"""What usually goes wrong with an environment is found, and the message says how to correct it."""

import threading
from typing import Any, ClassVar

import gymnasium
import numpy as np
import pettingzoo
import pytest
from gymnasium.spaces import Box, Discrete

from tuckerl import Simulator, TabularMDP
from tuckerl.adapters.seeding import EpisodeSeeds
from tuckerl.errors import ProblemCheckError, UnknownNameError
from tuckerl.testing import check_problem
from tuckerl.testing.small_problems import corridor

Info = dict[str, Any]


class SearchControl(gymnasium.Env[Any, Any]):
    """Five places; chance moves, too. Right, and the base of what is wrong."""

    def __init__(self) -> None:
        self.observation_space: Any = Discrete(5)
        self.action_space: Any = Discrete(2)
        self.place = 0

    def reset(self, *, seed: int | None = None, options: Info | None = None) -> tuple[Any, Info]:
        super().reset(seed=seed)
        self.place = int(self.np_random.integers(3))
        return self.place, {}

    def step(self, action: Any) -> tuple[Any, Any, Any, bool, Info]:
        move = 1 if action == 1 or self.chance() < 0.2 else -1
        self.place = min(max(self.place + move, 0), 4)
        return self.place, self.reward(), self.ended(), False, self.info()

    def chance(self) -> float:
        return float(self.np_random.random())

    def reward(self) -> Any:
        return -1.0

    def ended(self) -> Any:
        return self.place == 4

    def info(self) -> Info:
        return {}


class NoSeed(SearchControl):
    def reset(self, *, options: Info | None = None) -> Any:  # type: ignore[override]
        return 0, {}


class Unseeded(SearchControl):
    def reset(self, *, seed: int | None = None, options: Info | None = None) -> Any:
        self.place = 0
        return self.place, {}


class PaysNothing(SearchControl):
    def reward(self) -> Any:
        return float("nan") if self.place == 3 else -1.0


class PaysWords(SearchControl):
    def reward(self) -> Any:
        return "much" if self.place == 3 else -1.0


class EndsByNumber(SearchControl):
    def ended(self) -> Any:
        return 1 if self.place == 4 else False


class GoesBeyond(SearchControl):
    def step(self, action: Any) -> Any:
        place, *others = super().step(action)
        return (7 if place == 4 else place), *others


class DrawsElsewhere(SearchControl):
    def chance(self) -> float:
        return float(np.random.random()) if self.place == 3 else super().chance()  # noqa: NPY002


class Remembers(SearchControl):
    """Does not set everything anew."""

    walked = 0

    def reward(self) -> Any:
        self.walked += 1
        return -2.0 if self.walked > 60 else -1.0


class Shares(SearchControl):
    """Keeps in the class what belongs to one environment."""

    tired: ClassVar[list[int]] = [0]

    def reset(self, *, seed: int | None = None, options: Info | None = None) -> Any:
        self.tired[0] = 0
        return super().reset(seed=seed)

    def reward(self) -> Any:
        self.tired[0] += 1
        return -float(self.tired[0])


class Grows(SearchControl):
    resets = 0

    def reset(self, *, seed: int | None = None, options: Info | None = None) -> Any:
        self.resets += 1
        if self.resets > 12:
            self.observation_space = Discrete(6)
        return super().reset(seed=seed)


class NeverEnds(SearchControl):
    def ended(self) -> Any:
        return False


class Breaks(SearchControl):
    def step(self, action: Any) -> Any:
        if self.place == 3:
            raise ZeroDivisionError("nothing to divide by")
        return super().step(action)


class CannotBeCopied(SearchControl):
    def __init__(self) -> None:
        super().__init__()
        self.lock = threading.Lock()


class Continuous(SearchControl):
    def __init__(self) -> None:
        super().__init__()
        self.action_space = Box(-1.0, 1.0)


class MasksAll(SearchControl):
    def info(self) -> Info:
        return {"action_mask": np.array([0, 0] if self.place == 1 else [1, 1], dtype=np.int8)}


class MasksThree(SearchControl):
    def info(self) -> Info:
        return {"action_mask": np.ones(3, dtype=np.int8)}


class OtherTable(SearchControl):
    """Carries transitions that it does not make."""

    mdp = corridor()


class OtherSize(SearchControl):
    mdp = TabularMDP([[0, 1], [0, 1]], [[0, 1], [0, 0]], [[False, True], [True, True]])


class OtherStart(SearchControl):
    """Begins where its table does not."""

    mdp = corridor()

    def reset(self, *, seed: int | None = None, options: Info | None = None) -> Any:
        super().reset(seed=seed)
        self.place = 2
        return self.place, {}


def _reset(parameters: Any, state: Any, rng: Any) -> None:
    state[0] = 0.0


def _step(parameters: Any, state: Any, action: int, rng: Any) -> Any:
    state[0] = min(state[0] + 1.0, 4.0)
    return -1.0, state[0] == 4.0


class OtherSimulator(SearchControl):
    """Carries a simulator that only goes right."""

    simulator = Simulator(_reset, _step, n_states=5, n_actions=2)

    def reset(self, *, seed: int | None = None, options: Info | None = None) -> Any:
        super().reset(seed=seed)
        self.place = 0
        return self.place, {}


def test_a_right_environment_passes_in_every_form() -> None:
    check_problem(SearchControl())
    check_problem(SearchControl)
    check_problem(gymnasium.wrappers.TimeLimit(SearchControl(), 20))


@pytest.mark.parametrize(
    ("env", "message"),
    [
        (NoSeed, r"NoSeed does not pass gymnasium.utils.env_checker.check_env: .*`seed`"),
        (Unseeded, r"Unseeded does not pass .* `super\(\).reset\(seed=seed\)`"),
        (PaysNothing, r"a reward must be a finite number; in step \d+ of episode \d+ .* it was nan: return float"),
        (PaysWords, r"a reward must be a finite number; .* it was 'much'"),
        (EndsByNumber, r"terminated must be True or False; .* it was 1: write bool"),
        (GoesBeyond, r"an observation must lie in Discrete\(5\); .* it was 7: make the space larger"),
        (DrawsElsewhere, r"the same seed and the same actions must lead to the same play; .* draw from self.np_random"),
        (Remembers, r"the same seed .* the reward was -1.0, then -2.0: .* let reset set everything anew"),
        (Shares, r"two environments side by side must not touch each other; .* keep what changes in self"),
        (Grows, r"spaces must stay as they are, .* became Discrete\(6\) and Discrete\(2\): declare the largest"),
        (Breaks, r"Breaks raised ZeroDivisionError in step \d+ of episode 0: nothing to divide by"),
        (Continuous, r"action must be one of finitely many"),
        (MasksAll, r"an action mask must allow at least one action .* it was array\(\[0, 0\].* return terminated=True"),
        (MasksThree, r"an action mask must be a row of 2 entries"),
        (OtherTable, r"OtherTable began in state \d in the reset of episode \d, which is no first state of the table"),
        (OtherSize, r"carries have 2 states and 2 actions, and its spaces have 5 and 2: correct one of them"),
        (OtherStart, r"began in state 2 .* or learn with compiled=False"),
        (OtherSimulator, r"OtherSimulator came to state \d .* and the simulator that it carries to \d with -1.0"),
    ],
)
def test_a_mistake_of_an_environment_is_found(env: type[SearchControl], message: str) -> None:
    with pytest.raises(ProblemCheckError, match=message):
        check_problem(env)


def test_an_outcome_that_no_table_holds_is_found() -> None:
    class Slips(OtherStart):
        def reset(self, *, seed: int | None = None, options: Info | None = None) -> Any:
            super().reset(seed=seed)
            self.place = 0
            return self.place, {}

    with pytest.raises(ProblemCheckError, match=r"action \d in state \d led Slips to state \d with reward -1.0"):
        check_problem(Slips)


def test_an_episode_that_never_ends_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tuckerl.testing.playing.LONGEST", 1000)
    with pytest.raises(
        ProblemCheckError, match=r"an episode of NeverEnds did not end in 1,000 steps .*max_episode_steps"
    ):
        check_problem(NeverEnds)
    check_problem(gymnasium.wrappers.TimeLimit(NeverEnds(), 100))


def test_an_instance_that_cannot_be_copied_needs_a_callable() -> None:
    with pytest.raises(ProblemCheckError, match=r"cannot be copied .*\(TypeError: .*, or a callable that makes one"):
        check_problem(CannotBeCopied())
    check_problem(CannotBeCopied)


def test_an_unknown_id_is_no_mistake_of_a_problem() -> None:
    with pytest.raises(UnknownNameError, match="did you mean 'Taxi-v4'"):
        check_problem("Taxi-v5")


class Pair(pettingzoo.ParallelEnv):  # type: ignore[misc]  # PettingZoo's own is Any to the type checker
    """Two agents who walk to the fourth place; who is there leaves. Right, and the base of what is wrong."""

    metadata: ClassVar[Info] = {"name": "pair"}
    first_reward: Any = -1.0

    def __init__(self) -> None:
        self.possible_agents = ["a", "b"]
        self._spaces = {agent: (Discrete(5), Discrete(2)) for agent in self.possible_agents}

    def observation_space(self, agent: str) -> Any:
        return self._spaces[agent][0]

    def action_space(self, agent: str) -> Any:
        return self._spaces[agent][1]

    def reset(self, seed: int | None = None, options: Info | None = None) -> Any:
        if seed is not None:
            self.np_random = np.random.default_rng(seed)
        self.agents = list(self.possible_agents)
        self.places = dict.fromkeys(self.agents, 0)
        return dict(self.places), {agent: {} for agent in self.agents}

    def step(self, actions: Any) -> Any:
        acted = list(self.agents)
        for agent in acted:
            self.places[agent] = min(max(self.places[agent] + (1 if actions[agent] else -1), 0), 4)
        ends = {agent: self.places[agent] == 4 for agent in acted}
        self.agents = [agent for agent in acted if not ends[agent]]
        seen = {agent: self.places[agent] for agent in acted}
        rewards = {agent: self.first_reward if agent == "a" else -1.0 for agent in acted}
        return seen, rewards, ends, dict.fromkeys(acted, False), {agent: {} for agent in acted}


class PairWithoutNumbers(Pair):
    first_reward = float("inf")


class PairThatStays(Pair):
    """Agents who have ended stay in the list."""

    def step(self, actions: Any) -> Any:
        before, result = list(self.agents), super().step(actions)
        self.agents = before
        return result


class PairByChance(Pair):
    def step(self, actions: Any) -> Any:
        seen, rewards, *others = super().step(actions)
        return seen, {agent: float(np.random.random()) for agent in rewards}, *others  # noqa: NPY002


class PairOfFour(Pair):
    def step(self, actions: Any) -> Any:
        seen, *others = super().step(actions)
        return {agent: 9 if place == 3 else place for agent, place in seen.items()}, *others


class PairUnpaid(Pair):
    """Gives nothing to those who leave."""

    def step(self, actions: Any) -> Any:
        seen, rewards, ends, *others = super().step(actions)
        return seen, {agent: pay for agent, pay in rewards.items() if not ends[agent]}, ends, *others


class LatePair(Pair):
    def reset(self, seed: int | None = None, options: Info | None = None) -> Any:
        seen, infos = super().reset(seed)
        self.agents.remove("b")
        return {"a": seen["a"]}, {"a": infos["a"]}

    def step(self, actions: Any) -> Any:
        result = super().step(actions)
        if "b" not in actions:
            self.agents = [*self.agents, "b"]
        return result


class PairOfNobody(Pair):
    def __init__(self) -> None:
        super().__init__()
        self.possible_agents = []


class PairWithNewSpaces(Pair):
    def observation_space(self, agent: str) -> Any:
        return Discrete(5)


class PairMasked(Pair):
    def step(self, actions: Any) -> Any:
        *others, infos = super().step(actions)
        return *others, {agent: {"action_mask": [0, 0]} for agent in infos}


def test_a_right_parallel_environment_passes_in_every_form() -> None:
    check_problem(Pair())
    check_problem(Pair)


@pytest.mark.parametrize(
    ("env", "message"),
    [
        (PairWithoutNumbers, r"a reward must be a finite number; for a in step 1 of episode 0 .* it was inf"),
        (PairThatStays, r"must be taken out of `agents`; in step \d+ of episode 0 of PairThatStays [ab] stayed"),
        (PairByChance, r"the same seed and the same actions .* the reward was \{'a': .*draw from self.np_random"),
        (PairOfFour, r"an observation must lie in Discrete\(5\); in step \d+ of episode \d+, for [ab], .* it was 9"),
        (PairUnpaid, r"every agent that acted must be given its reward, its last one, too; .* [ab] got none"),
        (LatePair, r"agents must be there from an episode's beginning; b came in step 1 of episode 0"),
        (PairOfNobody, r"must list all agents that it may have as `possible_agents`"),
        (
            PairWithNewSpaces,
            r"does not pass pettingzoo.test.parallel_api_test: observation_space should return the exact",
        ),
        (PairMasked, r"an action mask must allow at least one action"),
    ],
)
def test_a_mistake_of_a_parallel_environment_is_found(env: type[Pair], message: str) -> None:
    with pytest.raises(ProblemCheckError, match=message):
        check_problem(env)


def test_the_first_reset_is_seeded_as_learners_do() -> None:
    env = SearchControl()
    seeds = EpisodeSeeds(env)
    first = [seeds.reset()[0] for _ in range(4)]
    again = EpisodeSeeds(env)
    assert first == [again.reset()[0] for _ in range(4)]
