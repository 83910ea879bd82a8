"""Checks of PettingZoo's parallel environments."""

import contextlib
import copy
import io
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from pettingzoo.test import parallel_api_test
from pettingzoo.utils.conversions import (
    aec_to_parallel_wrapper,
    parallel_to_aec_wrapper,
    turn_based_aec_to_parallel_wrapper,
)

from tuckerl.errors import ProblemCheckError, SpaceError
from tuckerl.problems.coding import coding
from tuckerl.problems.joint import JointEnv
from tuckerl.problems.masks import MaskReader
from tuckerl.problems.mdp import TabularMDP
from tuckerl.problems.resolve import Agents, Reading, as_problem
from tuckerl.problems.seeding import EpisodeSeeds
from tuckerl.rng import child, seed_sequence
from tuckerl.testing.arrays import check_arrays
from tuckerl.testing.carried import check_carried_table
from tuckerl.testing.environments import (
    SEEDS_DECIDE,
    SEEDS_MEND,
    GymStage,
    another,
    check_beside,
    check_observation,
    check_reward,
    name_of,
    observation_coding,
    read_mask,
)
from tuckerl.testing.playing import Moment, Stage, check_equal, moments

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
    sequence = seed_sequence(seed)
    played = list(moments(stage, child(sequence, 0), episodes))
    _check_by_pettingzoo(another(env, make, source), source)
    check_equal(played, moments(stage, child(sequence, 0), episodes), SEEDS_DECIDE, SEEDS_MEND)
    check_beside(stage, ParallelStage(another(env, make, source), source), sequence, played)
    _check_carried(env, source, sequence, episodes)


class ParallelStage(Stage):
    """A parallel environment to be played at random."""

    def __init__(self, env: Any, source: str) -> None:
        super().__init__(env, source)
        self.players = tuple(getattr(env, "possible_agents", None) or ())
        if not self.players:
            raise ProblemCheckError(f"{source} must list all agents that it may have as `possible_agents`")
        self._actions = {
            player: coding(env.action_space(player), what=f"action of {player}") for player in self.players
        }
        self._read = {
            player: MaskReader(env.observation_space(player), env.action_space(player)) for player in self.players
        }
        for reader in self._read.values():
            observation_coding(reader.observation_space)
        self._spaces = copy.deepcopy(self._present_spaces())
        self._masks: dict[Any, Any] = {}
        self._live: tuple[Any, ...] = ()

    def _present_spaces(self) -> dict[Any, Any]:
        return {p: (self.env.observation_space(p), self.env.action_space(p)) for p in self.players}

    @property
    def is_over(self) -> bool:
        """Whether all agents have left."""
        return not self._live

    def begin(self, seeds: EpisodeSeeds, where: str) -> Moment:
        """Begin an episode of all agents."""
        observations, infos = seeds.reset()
        if self._present_spaces() != self._spaces:
            raise ProblemCheckError(
                f"spaces must stay as they are, as tables have as many rows and columns; {where} those of "
                f"{self.source} became {self._present_spaces()}: declare the largest"
            )
        self._live = tuple(self.env.agents)
        self._check_players(observations, where)
        return self._seen(Moment(where, None, observations, None, {}, {}), infos)

    def act(self, rng: np.random.Generator, where: str) -> Moment:
        """Let all agents take random actions that are allowed."""
        codes = {player: self._code(player, rng) for player in self._live}
        chosen = {player: self._actions[player].decode(code) for player, code in codes.items()}
        observations, rewards, terminations, truncations, infos = self.env.step(chosen)
        for name, given in (("observation", observations), ("reward", rewards), ("termination", terminations)):
            missing = [player for player in chosen if player not in given]
            if missing:
                raise ProblemCheckError(
                    f"every agent that acted must be given its {name}, its last one, too; {where} of {self.source} "
                    f"{missing[0]} got none"
                )
        late = [player for player in self.env.agents if player not in chosen]
        if late:
            raise ProblemCheckError(
                f"agents must be there from an episode's beginning; {late[0]} came {where} of {self.source}: let it "
                "wait, with an observation that says so"
            )
        ended = [player for player in self.env.agents if terminations[player] or truncations.get(player)]
        if ended:
            raise ProblemCheckError(
                f"an agent that has terminated or was truncated must be taken out of `agents`; {where} of "
                f"{self.source} {ended[0]} stayed"
            )
        for player in chosen:
            check_reward(rewards[player], f"for {player} {where} (actions {chosen})", self.source)
        self._live = tuple(p for p in chosen if not terminations[p] and not truncations.get(p))
        moment = Moment(where, codes, observations, dict(rewards), dict(terminations), dict(truncations))
        return self._seen(moment, infos)

    def _code(self, player: Any, rng: np.random.Generator) -> int:
        mask = self._masks.get(player)
        return int(rng.integers(self._actions[player].n) if mask is None else rng.choice(np.flatnonzero(mask)))

    def _check_players(self, observations: Any, where: str) -> None:
        unknown = [player for player in self._live if player not in self.players]
        if unknown:
            raise ProblemCheckError(
                f"agents must be among possible_agents, {self.players}; {where} of {self.source} there was "
                f"{unknown[0]!r}"
            )
        missing = [player for player in self._live if player not in observations]
        if missing or not self._live:
            raise ProblemCheckError(
                f"reset must return an observation for every agent in `agents`, of which there is one at least; "
                f"{where} of {self.source} the agents were {self._live}, and those observed {tuple(observations)}"
            )

    def _seen(self, moment: Moment, infos: Any) -> Moment:
        parts = {}
        for player, observation in moment.observation.items():
            space = self.env.observation_space(player)
            check_observation(space, observation, f"{moment.where}, for {player},", self.source)
            over = player not in self._live
            info = infos.get(player) or {}
            parts[player], self._masks[player] = read_mask(self._read[player], observation, info, moment, over=over)
        return moment._replace(observation=copy.deepcopy(parts), mask=copy.deepcopy(self._masks))


def _check_by_pettingzoo(env: Any, source: str) -> None:
    if isinstance(env.unwrapped, _CONVERTED):
        return
    with warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()):
        warnings.simplefilter("ignore")
        try:
            parallel_api_test(env, num_cycles=_CYCLES)
        except Exception as error:  # it raises AssertionError, and whatever the environment does
            raise ProblemCheckError(
                f"{source} does not pass pettingzoo.test.parallel_api_test: {str(error) or repr(error)}"
            ) from error


def _check_carried(env: Any, source: str, sequence: np.random.SeedSequence, episodes: int) -> None:
    """Check the joint transitions that an environment carries, if any: Team-Q plays those."""
    try:
        problem = as_problem(env, Reading(Agents.TEAM))
    except SpaceError:  # a Box without bins
        return
    if isinstance(problem, TabularMDP):
        check_arrays(problem, source)
        stage = GymStage(JointEnv(env), source)
        check_carried_table(problem, stage, list(moments(stage, child(sequence, 2), episodes)))
