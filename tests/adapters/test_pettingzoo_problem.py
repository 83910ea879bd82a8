"""What a kernel sees of an environment of several agents."""

from typing import Any

import pytest
from gymnasium import spaces

from tests.adapters.parallel_worlds import Leaving, Masked, Meeting, Unequal, altered
from tuckerl.adapters.pettingzoo_problem import PettingZooProblem, PettingZooWorld
from tuckerl.errors import EnvironmentFaultError, ProblemError, SpaceError
from tuckerl.problems.dynamics import TERMINATED, TRUNCATED, step_together
from tuckerl.rng import seed_sequence


def world_of(env: Any) -> PettingZooWorld:
    world = PettingZooProblem(env, "world").world()
    world.seed(seed_sequence(1))
    world.set_deadline(60.0)
    return world


def test_all_agents_act_at_once() -> None:
    env = Leaving((1, 2, 3), truncated=("b",))
    world = world_of(env)
    step_together(world.arrays, True)
    assert world.arrays.playing.tolist() == [True] * 3
    world.arrays.action[:] = [1, 0, 1]
    step_together(world.arrays, False)
    assert env.received == [{"a": 1, "b": 0, "c": 1}]
    assert world.arrays.reward.tolist() == [2.0, 10.0, 200.0]
    assert world.arrays.end.tolist() == [TERMINATED, 0, 0]
    assert world.arrays.before.tolist() == [0, 0, 0]
    assert world.arrays.state.tolist() == [1, 1, 1]
    world.arrays.playing[0] = False  # as the kernel does
    step_together(world.arrays, False)
    assert env.received[1:] == [{"b": 0, "c": 1}]
    assert world.arrays.end.tolist() == [0, TRUNCATED, 0]
    assert world.arrays.status[0] == 0


def test_the_largest_agent_sizes_all_tables() -> None:
    problem = PettingZooProblem(Unequal(), "unequal")
    assert (problem.n_states, problem.n_actions, problem.has_equal_spaces) == (4, 8, False)
    assert problem.has_masks, "places that the scout has not got are forbidden"
    scout, carrier = problem.world().action_masks
    assert not scout[:, 3:].any()
    assert scout[:, :3].all()
    assert carrier.all()
    assert repr(problem) == "PettingZooProblem(unequal, 2 agents, 4 states, 8 actions, max_episode_steps=100000)"


def test_masks_are_each_agents_own() -> None:
    world = world_of(Masked())
    step_together(world.arrays, True)
    assert [table[0].tolist() for table in world.action_masks] == [[False, True, True], [True, False, True]]


def test_an_agent_that_has_left_need_not_be_observed() -> None:
    env = Leaving((1, 2))
    whole = env.step

    def forgetful(actions: Any) -> Any:
        observations, *rest = whole(actions)
        return {agent: seen for agent, seen in observations.items() if agent in env.agents}, *rest

    world = world_of(altered(env, step=forgetful))
    step_together(world.arrays, True)
    step_together(world.arrays, False)
    world.raise_pending()
    assert world.arrays.end.tolist() == [TERMINATED, 0]
    assert world.arrays.state.tolist() == [0, 1]


def test_rules_that_are_broken_are_named() -> None:
    def without(part: int) -> Any:
        env = Meeting()
        whole = env.step
        return altered(env, step=lambda actions: [{} if i == part else x for i, x in enumerate(whole(actions))])

    def later(env: Any) -> Any:
        whole = env.reset
        return altered(env, reset=lambda **how: tuple({"west": part["west"]} for part in whole(**how)), agents=["west"])

    for part, what in enumerate(("an observation", "a reward", "a termination", "a truncation")):
        world = world_of(without(part))
        step_together(world.arrays, True)
        world.arrays.action[:] = 1
        step_together(world.arrays, False)
        with pytest.raises(
            EnvironmentFaultError, match=f"step must return {what} of every agent that acted; none came of west"
        ):
            world.raise_pending()
    world = world_of(altered(Meeting(), reset=lambda **how: ({}, {})))
    step_together(world.arrays, True)
    with pytest.raises(EnvironmentFaultError, match="there must be agents after the reset"):
        world.raise_pending()
    env = later(Meeting())
    strict = env.step
    env.step = lambda actions: strict({"west": actions["west"], "east": 1})
    env.reset()
    env.agents = ["west", "east"]
    world = world_of(env)
    step_together(world.arrays, True)
    env.agents = ["west", "east"]
    step_together(world.arrays, False)
    with pytest.raises(
        EnvironmentFaultError, match="agents must be there from an episode's beginning; east came later"
    ):
        world.raise_pending()


def test_agents_that_were_not_listed_are_named() -> None:
    message = "agents must be among the possible_agents, west, east; got 'north'"
    env = Meeting()
    env.observation_spaces["north"] = env.action_spaces["north"] = spaces.Discrete(5)
    env.observe = lambda agent: 0  # type: ignore[method-assign]  # north observes, too
    world = world_of(env)
    env.possible_agents.append("north")
    step_together(world.arrays, True)
    with pytest.raises(EnvironmentFaultError, match=message):
        world.raise_pending()
    stranger = altered(Meeting(), reset=lambda **how: ({"north": 0}, {}))
    with pytest.raises(ProblemError, match=message):
        PettingZooProblem(stranger, "meeting")


def test_environments_that_do_not_name_their_agents_are_refused() -> None:
    env = Meeting()
    del env.possible_agents
    with pytest.raises(ProblemError, match="must list all agents that it may have as `possible_agents`"):
        PettingZooProblem(env, "meeting")


def test_spaces_are_named_by_their_agent() -> None:
    env = Meeting()
    env.action_spaces["east"] = spaces.Box(-1.0, 1.0)
    with pytest.raises(SpaceError, match="action of east must be one of finitely many"):
        PettingZooProblem(env, "meeting")
