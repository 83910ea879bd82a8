"""The loops that all algorithms are played in: one agent in its own world, or several agents in one world."""

from typing import Any

import numpy as np

from tuckerl._jit import kernel
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
from tuckerl.training.agent_arrays import (
    AFTER_EPISODE,
    AgentArrays,
    EpisodeRecord,
    Transition,
    begin_episode,
    must_stop,
    record_episode,
    record_state,
)
from tuckerl.training.algorithm import NOT_FINITE, act, end_episode, learn_and_act
from tuckerl.training.guards import strays


@kernel
def play(world: WorldArrays, agent: AgentArrays) -> int:
    """Let an agent play and learn the episodes that its record has room for.

    Parameters
    ----------
    world : NamedTuple
        The problem's arrays; its type selects the problem's kernels.
    agent : AgentArrays

    Returns
    -------
    int
        The number of episodes finished: fewer than there is room for where ``agent.record.max_steps`` was reached, or
        the world or ``agent.record.stop`` asked to return; -1 minus that number where the next one was broken off,
        because a value was not finite any more, or by an error, or because it was to stop at once.
    """
    record, settings, n_steps = agent.record, agent.settings, 0
    for episode in range(record.steps.size):
        if _is_enough(record, episode, n_steps):
            return episode
        state, steps, total, ended = reset(world, agent.rng), 0, 0.0, False
        if must_return(world) or strays(world, agent, state):
            return episode
        if must_stop(record, 0):
            return -1 - episode
        begin_episode(agent, episode)
        record_state(record, episode, 0, state)
        chosen = act(agent.algorithm, agent, state)
        if chosen == NOT_FINITE:
            end_episode(agent.algorithm, agent, False)
            return -1 - episode
        action: Any = np.uint32(chosen)  # unsigned, as states are: a tenth of the time
        while not ended:
            next_state, reward, terminated = step(world, state, action, agent.rng)
            if must_return(world) or must_stop(record, steps) or strays(world, agent, next_state):
                return -1 - episode
            steps, total = steps + 1, total + reward
            ended = terminated or is_out_of_time(world, steps)
            discount = settings.terminal_discount if terminated else settings.gamma
            transition = Transition(state, action, reward, discount, next_state, ended)
            chosen = learn_and_act(agent.algorithm, agent, transition)
            if chosen == NOT_FINITE:
                end_episode(agent.algorithm, agent, False)
                return -1 - episode
            state, action = next_state, np.uint32(chosen)
            record_state(record, episode, steps, state)
        if must_stop(record, steps) or not end_episode(agent.algorithm, agent, True):
            return -1 - episode
        record_episode(record, episode, steps, total)
        close_episode(agent.log, agent.q)
        n_steps += steps
    return record.steps.size


@kernel
def play_together(world: WorldArrays, agents: tuple[AgentArrays, ...]) -> int:
    """Let the agents of one world play and learn the episodes that their records have room for.

    Parameters
    ----------
    world : WorldArrays
    agents : tuple of AgentArrays
        In the order of the world's agents.

    Returns
    -------
    int
        As of `play`; the first agent's record says after how many steps no further episode begins.
    """
    record, n_steps = agents[0].record, 0
    for episode in range(record.steps.size):
        if _is_enough(record, episode, n_steps):
            return episode
        step_together(world, True)
        if must_return(world) or _stray_together(world, agents):
            return episode
        if not _begin_together(world, agents, episode):
            _break_off(agents)
            return -1 - episode
        steps, n_playing = 0, 1
        while n_playing > 0:
            step_together(world, False)
            if must_return(world) or _stray_together(world, agents):
                return -1 - episode
            steps += 1
            n_playing = _learn_together(world, agents, episode, steps)
            if n_playing < 0:
                _break_off(agents)
                return -1 - episode
        if must_stop(record, steps):
            return -1 - episode
        for agent in agents:
            close_episode(agent.log, agent.q)
        n_steps += steps
    return record.steps.size


@kernel
def _is_enough(record: EpisodeRecord, episode: int, n_steps: int) -> bool:
    """Return whether no further episode is to begin: one is always played, unless the kernel is to return at once."""
    return n_steps >= record.max_steps or record.stop[0] > (AFTER_EPISODE if episode == 0 else 0)


@kernel
def _begin_together(world: WorldArrays, agents: tuple[AgentArrays, ...], episode: int) -> bool:
    """Let every agent that is there choose its first action; return whether all could."""
    for i in range(len(agents)):
        agent = agents[i]
        record_episode(agent.record, episode, 0, 0.0)
        begin_episode(agent, episode)
        record_state(agent.record, episode, 0, 0)  # of those who are not there, too
        if world.playing[i]:
            state = world.state[i]
            record_state(agent.record, episode, 0, state)
            action = act(agent.algorithm, agent, state)
            if action == NOT_FINITE:
                return False
            world.action[i] = action
    return True


@kernel
def _stray_together(world: WorldArrays, agents: tuple[AgentArrays, ...]) -> bool:
    """Return whether a problem of a user's own has given an agent that plays a state that is none."""
    for i in range(len(agents)):
        if world.playing[i] and (strays(world, agents[i], world.state[i]) or strays(world, agents[i], world.before[i])):
            return True
    return False


@kernel
def _learn_together(world: WorldArrays, agents: tuple[AgentArrays, ...], episode: int, steps: int) -> int:
    """Let every agent that was playing learn from the step; return how many play on, -1 if a value is not finite."""
    n_playing = 0
    for i in range(len(agents)):
        if not world.playing[i]:
            continue
        agent = agents[i]
        state, action, next_state = world.before[i], world.action[i], world.state[i]
        reward, terminated = world.reward[i], world.end[i] == TERMINATED
        ended = world.end[i] > 0 or steps >= world.max_episode_steps
        discount = agent.settings.terminal_discount if terminated else agent.settings.gamma
        transition = Transition(state, action, reward, discount, next_state, ended)
        action = learn_and_act(agent.algorithm, agent, transition)
        if action == NOT_FINITE or (ended and not end_episode(agent.algorithm, agent, True)):
            return -1
        world.action[i] = action
        record_state(agent.record, episode, steps, next_state)
        record_episode(agent.record, episode, steps, agent.record.returns[episode] + reward)
        world.playing[i] = not ended
        n_playing += not ended
    return n_playing


@kernel
def _break_off(agents: tuple[AgentArrays, ...]) -> None:
    """End the episode of agents whose tables are not finite any more, so that these show it."""
    for agent in agents:
        end_episode(agent.algorithm, agent, False)
