"""The loops that all algorithms are played in: an agent alone in its world, or several agents in one world.

An algorithm is three kernels: `first` chooses an episode's first action, `turn` learns from a step and chooses the next
action, `leave` ends an episode. It is listed by `algorithm`, in its own file, under the type of its own NamedTuple; the
choice is made when a loop is compiled.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from tuckerl._jit import by_kind, kernel
from tuckerl.generalization.change_log import close_episode
from tuckerl.problems.dynamics import (
    TERMINATED,
    WorldArrays,
    is_out_of_time,
    must_return,
    reset,
    step,
    step_together,
)
from tuckerl.training.agent_arrays import Agent, Transition, note_episode, note_state, set_step_sizes

NOT_FINITE = -1
"""What `turn` returns instead of an action when a value has left the finite numbers."""

_FIRST: dict[type, Callable[..., int]] = {}
_TURN: dict[type, Callable[..., int]] = {}
_LEAVE: dict[type, Callable[..., bool]] = {}

_first, _turn, _leave = by_kind(_FIRST), by_kind(_TURN), by_kind(_LEAVE)


def algorithm(
    method: type, *, first: Callable[..., int], turn: Callable[..., int], leave: Callable[..., bool] | None = None
) -> None:
    """List an algorithm under the type of its own NamedTuple.

    Parameters
    ----------
    method : type
    first : kernel ``(method, agent, state, epsilon) -> action``
    turn : kernel ``(method, agent, transition, epsilon) -> next action``
        Returns `NOT_FINITE` where a value is; anything after the end.
    leave : kernel ``(method, agent, finished) -> bool``, optional
        Ends an episode, or breaks it off; returns whether the table is finite. Default: nothing to do.
    """
    _FIRST[method], _TURN[method], _LEAVE[method] = first, turn, leave or _leave_as_it_is


@kernel
def _leave_as_it_is(method: Any, agent: Agent, finished: bool) -> bool:
    return True


@kernel
def play(world: WorldArrays, agent: Agent) -> int:
    """Let an agent play and learn the episodes that its record has room for.

    Return how many were finished: fewer where the steps were enough or the world halted, and -1 minus their number
    where the table then left the finite numbers.
    """
    method, record, settings, n_steps = agent.method, agent.record, agent.settings, 0
    for episode in range(record.steps.size):
        if n_steps >= record.enough:
            return episode
        state, steps, total, ended, epsilon = reset(world, agent.rng), 0, 0.0, False, record.epsilon[episode]
        if must_return(world):
            return episode
        set_step_sizes(agent, episode)
        note_state(record, 0, state)
        action: Any = np.uint32(_first(method, agent, state, epsilon))  # unsigned, as states are: a tenth of the time
        while not ended:
            next_state, reward, terminated = step(world, state, action, agent.rng)
            if must_return(world):
                _leave(method, agent, False)
                return episode
            steps, total = steps + 1, total + reward
            ended = terminated or is_out_of_time(world, steps)
            discount = settings.terminal_discount if terminated else settings.gamma
            chosen = _turn(method, agent, Transition(state, action, reward, discount, next_state, ended), epsilon)
            if chosen == NOT_FINITE:
                return -1 - episode
            state, action = next_state, np.uint32(chosen)
            note_state(record, steps, state)
        if not _leave(method, agent, True):
            return -1 - episode
        note_episode(record, episode, steps, total)
        close_episode(agent.log, agent.q)
        n_steps += steps
    return record.steps.size


@kernel
def play_together(world: WorldArrays, agents: tuple[Agent, ...]) -> int:
    """Let the agents of one world play and learn the episodes that their records have room for; return as `play`."""
    record, n_steps = agents[0].record, 0
    for episode in range(record.steps.size):
        if n_steps >= record.enough:
            return episode
        step_together(world, True)
        if must_return(world):
            return episode
        _begin_together(world, agents, episode)
        steps, n_playing = 0, 1
        while n_playing > 0:
            step_together(world, False)
            if must_return(world):
                _break_off(agents)
                return episode
            steps += 1
            n_playing = _turn_together(world, agents, episode, steps)
            if n_playing < 0:
                return -1 - episode
        for agent in agents:
            close_episode(agent.log, agent.q)
        n_steps += steps
    return record.steps.size


@kernel
def _begin_together(world: WorldArrays, agents: tuple[Agent, ...], episode: int) -> None:
    for player in range(len(agents)):
        agent = agents[player]
        agent.record.steps[episode], agent.record.returns[episode] = 0, 0.0
        set_step_sizes(agent, episode)
        if world.playing[player]:
            state = world.state[player]
            note_state(agent.record, 0, state)
            world.action[player] = _first(agent.method, agent, state, agent.record.epsilon[episode])


@kernel
def _turn_together(world: WorldArrays, agents: tuple[Agent, ...], episode: int, steps: int) -> int:
    """Let every agent that was playing learn from the step; return how many play on, -1 where one is not finite."""
    n_playing = 0
    for player in range(len(agents)):
        if not world.playing[player]:
            continue
        agent = agents[player]
        state, action, next_state = world.before[player], world.action[player], world.state[player]
        reward, terminated = world.reward[player], world.end[player] == TERMINATED
        ended = world.end[player] > 0 or steps >= world.max_episode_steps
        discount = agent.settings.terminal_discount if terminated else agent.settings.gamma
        seen = Transition(state, action, reward, discount, next_state, ended)
        action = _turn(agent.method, agent, seen, agent.record.epsilon[episode])
        if action == NOT_FINITE or (ended and not _leave(agent.method, agent, True)):
            return -1
        world.action[player] = action
        note_state(agent.record, steps, next_state)
        note_episode(agent.record, episode, steps, agent.record.returns[episode] + reward)
        world.playing[player] = not ended
        n_playing += not ended
    return n_playing


@kernel
def _break_off(agents: tuple[Agent, ...]) -> None:
    for agent in agents:
        _leave(agent.method, agent, False)
