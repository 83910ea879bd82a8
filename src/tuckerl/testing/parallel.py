"""Checks of PettingZoo's parallel environments."""

import copy
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from pettingzoo.test import parallel_api_test
from pettingzoo.utils.conversions import (
    aec_to_parallel_wrapper,
    parallel_to_aec_wrapper,
    turn_based_aec_to_parallel_wrapper,
)

from tuckerl.adapters.joint import JointEnv, agents_of
from tuckerl.adapters.making import name_of
from tuckerl.adapters.masks import MaskReader
from tuckerl.adapters.python_world import EnvironmentCopies
from tuckerl.adapters.resolve import AdapterOptions, Agents, as_problem
from tuckerl.adapters.seeding import EpisodeSeeds
from tuckerl.checks import shown
from tuckerl.errors import ProblemCheckError, SpaceError
from tuckerl.rng import child, seed_sequence
from tuckerl.spaces.encoder import space_encoder
from tuckerl.testing.carried import check_carried
from tuckerl.testing.environments import (
    SEEDS_ADVICE,
    SEEDS_DECIDE,
    GymStage,
    check_beside,
    check_by_library,
    check_observation,
    check_reward,
    encoder_of_observations,
    read_mask,
)
from tuckerl.testing.playing import Moment, Stage, check_equal, moments, random_code

_CYCLES = 200  # of PettingZoo's own test
# What PettingZoo's test refuses, without a word: environments made of others that it tests in their own form.
_CONVERTED = (aec_to_parallel_wrapper, parallel_to_aec_wrapper, turn_based_aec_to_parallel_wrapper)


def check_parallel(env: Any, make: Callable[[], Any] | None, episodes: int, seed: int) -> None:
    """Check a PettingZoo parallel environment.

    Raises
    ------
    ProblemCheckError
    """
    source = name_of(env)
    stage = ParallelStage(env, source)
    sequence, copies = seed_sequence(seed), EnvironmentCopies(env, source, make)
    played = list(moments(stage, child(sequence, 0), episodes))
    other = copies.another()
    if not isinstance(other.unwrapped, _CONVERTED):
        test = partial(parallel_api_test, other, num_cycles=_CYCLES)
        check_by_library(test, "pettingzoo.test.parallel_api_test", source)
    check_equal(played, moments(stage, child(sequence, 0), episodes), SEEDS_DECIDE, SEEDS_ADVICE)
    check_beside(stage, ParallelStage(copies.another(), source), sequence, played)
    _check_carried(env, source, episodes, seed)


class ParallelStage(Stage):
    """A parallel environment to be played at random."""

    def __init__(self, env: Any, source: str) -> None:
        super().__init__(env, source)
        self.agents = tuple(agents_of(env))
        self._actions = {
            agent: space_encoder(env.action_space(agent), what=f"action of {agent}") for agent in self.agents
        }
        self._read = {agent: MaskReader(env.observation_space(agent), env.action_space(agent)) for agent in self.agents}
        for reader in self._read.values():
            encoder_of_observations(reader.observation_space)
        self._spaces = copy.deepcopy(self._present_spaces())
        self._masks: dict[Any, Any] = {}
        self._live: tuple[Any, ...] = ()  # who has not left

    def _present_spaces(self) -> dict[Any, Any]:
        return {p: (self.env.observation_space(p), self.env.action_space(p)) for p in self.agents}

    def begin(self, seeds: EpisodeSeeds, where: str) -> Moment:
        """Begin an episode of all agents."""
        observations, infos = seeds.reset()
        if self._present_spaces() != self._spaces:
            raise ProblemCheckError(
                f"spaces must stay as they are, as tables have as many rows and columns; {where} those of "
                f"{self.source} became {self._present_spaces()}: declare the largest"
            )
        self._live, self.is_over = tuple(self.env.agents), False
        self._check_agents(observations, where)
        return self._seen(Moment(where, None, observations, None, {}, {}), infos)

    def act(self, rng: np.random.Generator, where: str) -> Moment:
        """Let all agents take random actions that are allowed."""
        codes = {p: random_code(rng, self._actions[p].n, self._masks.get(p)) for p in self._live}
        chosen = {agent: self._actions[agent].decode(code) for agent, code in codes.items()}
        observations, rewards, terminations, truncations, infos = self.env.step(chosen)
        for name, given in (("observation", observations), ("reward", rewards), ("termination", terminations)):
            missing = [agent for agent in chosen if agent not in given]
            if missing:
                raise ProblemCheckError(
                    f"every agent that acted must be given its {name}, its last one, too; {where} of {self.source} "
                    f"{missing[0]} got none"
                )
        late = [agent for agent in self.env.agents if agent not in chosen]
        if late:
            raise ProblemCheckError(
                f"agents must be there from an episode's beginning; {late[0]} came {where} of {self.source}: let it "
                "wait, with an observation that says so"
            )
        ended = [agent for agent in self.env.agents if terminations[agent] or truncations.get(agent)]
        if ended:
            raise ProblemCheckError(
                f"an agent that has terminated or was truncated must be taken out of `agents`; {where} of "
                f"{self.source} {ended[0]} stayed"
            )
        for agent in chosen:
            check_reward(rewards[agent], f"for {agent} {where} (actions {chosen})", self.source)
        self._live = tuple(p for p in chosen if not terminations[p] and not truncations.get(p))
        self.is_over = not self._live
        moment = Moment(where, codes, observations, dict(rewards), dict(terminations), dict(truncations))
        return self._seen(moment, infos)

    def _check_agents(self, observations: Any, where: str) -> None:
        unknown = [agent for agent in self._live if agent not in self.agents]
        if unknown:
            raise ProblemCheckError(
                f"agents must be among possible_agents, {self.agents}; {where} of {self.source} there was "
                f"{shown(unknown[0])}"
            )
        missing = [agent for agent in self._live if agent not in observations]
        if missing or not self._live:
            raise ProblemCheckError(
                f"reset must return an observation for every agent in `agents`, of which there is one at least; "
                f"{where} of {self.source} the agents were {self._live}, and those observed {tuple(observations)}"
            )

    def _seen(self, moment: Moment, infos: Any) -> Moment:
        parts = {}
        for agent, observation in moment.observation.items():
            space = self.env.observation_space(agent)
            check_observation(space, observation, f"{moment.where}, for {agent},", self.source)
            over = agent not in self._live
            info = infos.get(agent) or {}
            parts[agent], self._masks[agent] = read_mask(self._read[agent], observation, info, moment, over=over)
        return moment._replace(observation=copy.deepcopy(parts), mask=copy.deepcopy(self._masks))


def _check_carried(env: Any, source: str, episodes: int, seed: int) -> None:
    """Check the joint transitions that an environment carries, if any: Team-Q plays those."""
    try:
        problem = as_problem(env, AdapterOptions(Agents.JOINT))
    except SpaceError:  # a Box without bins
        return
    if problem.is_compiled:
        stage = GymStage(JointEnv(env), source)
        played = list(moments(stage, child(seed_sequence(seed), 2), episodes))
        check_carried(problem, stage, played, episodes, seed)
