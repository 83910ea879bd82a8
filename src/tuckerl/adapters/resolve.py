"""From whatever a user calls an environment to the problem that kernels play."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Any

import gymnasium
import numpy as np
from gymnasium import ActionWrapper, ObservationWrapper, RewardWrapper, Wrapper
from gymnasium.wrappers import (
    AtariPreprocessing,
    Autoreset,
    MaxAndSkipObservation,
    OrderEnforcing,
    PassiveEnvChecker,
    TimeLimit,
)
from pettingzoo.utils import BaseParallelWrapper

from tuckerl.adapters.alike import checked_maker
from tuckerl.adapters.carried import carried_problem, check_by_playing, plays_what_it_carries
from tuckerl.adapters.gymnasium_problem import GymnasiumProblem
from tuckerl.adapters.joint import JointEnv
from tuckerl.adapters.making import GymEnvironment, Made, close, made_of, name_of
from tuckerl.adapters.pettingzoo_problem import PettingZooProblem
from tuckerl.adapters.python_problem import AgentSpaces
from tuckerl.adapters.team import Team
from tuckerl.checks import shown
from tuckerl.errors import NoTableError, ParameterError, ParameterTypeError, ProblemError, SpaceError
from tuckerl.problems.maze import Maze
from tuckerl.problems.mdp import TabularMDP
from tuckerl.problems.parts import STEP_CAP
from tuckerl.problems.problem import Problem

Environment = str | Made | Callable[[], Made] | Problem | Maze

# Wrappers that leave observations, rewards and ends as they are (but for the time limit, which is taken over).
_TRANSPARENT = (TimeLimit, OrderEnforcing, PassiveEnvChecker)
# Steps of wrappers that are one step of what they wrap, and wrappers of Gymnasium whose steps are not.
_ONE_FOR_ONE = (Wrapper.step, ActionWrapper.step, ObservationWrapper.step, RewardWrapper.step)
_RETIMING = (AtariPreprocessing, Autoreset, MaxAndSkipObservation)


class Agents(Enum):
    """What a learner makes of a PettingZoo environment."""

    INDEPENDENT = "every agent has a table of its own"
    JOINT = "one table over joint observations and joint actions"


@dataclass(frozen=True)
class AdapterOptions:
    """How a problem is made of an environment.

    Parameters
    ----------
    agents : Agents
    bins
        How a Box is cut into bins; see :func:`tuckerl.spaces.encoder.space_encoder`.
    compiled : "auto" or bool
        Whether an environment whose transition table can be extracted is played from it, in compiled code; True refuses
        one where it cannot be.
    reward : str
        What joint actions are paid: the ``"mean"`` or the ``"sum"`` of the agents' rewards, or one agent's, by its
        name.
    tries_out : bool
        Whether an environment is reset once before it is played, to find mistakes and masks early.
    """

    agents: Agents = Agents.INDEPENDENT
    bins: Any = None
    compiled: str | bool = "auto"
    reward: str = "mean"
    tries_out: bool = True


def as_problem(env: Environment, options: AdapterOptions = AdapterOptions()) -> Problem:  # it is frozen
    """Return the problem that kernels play for an environment.

    A problem of this library is played as it is. Of this library's own environments, and of Gymnasium's `FrozenLake`,
    `CliffWalking` and `Taxi`, the transitions that they carry are extracted and played in compiled code, unless a
    subclass overrides more than how they are made, shown and closed. With ``compiled=True`` so are those of other
    environments, if some thousand random steps agree with them: a :class:`TabularMDP` in the attribute ``mdp``, or a
    table ``P`` with ``initial_state_distrib``. Only wrappers that change nothing may stand around: Gymnasium's checker,
    its order enforcer and its time limit, which is taken over. Every other environment is stepped in Python. Where
    there is no time limit, episodes are cut off after 100,000 steps.

    Parameters
    ----------
    env
        A :class:`TabularMDP`, a :class:`Simulator`, a :class:`Maze`; or a Gymnasium environment or a PettingZoo
        parallel environment: by id (Gymnasium's, else PettingZoo's), as an instance, or as a callable that makes one.
    options : AdapterOptions

    Raises
    ------
    UnknownNameError
        If no environment has this id.
    ParameterError, ParameterTypeError
        If `bins` or `reward` are of no use to the problem, or `env` is none of these.
    SpaceError
        If its spaces cannot be numbered.
    ProblemError
        If it does not begin, its joint actions do not belong to its agents, what a callable makes is drawn anew each
        time, or `compiled` is True and it cannot be compiled, or its steps differ from its table.
    """
    check_compiled(options.compiled)
    if isinstance(env, (Problem, Maze)):
        return _own_problem(env, options)
    made, make = made_of(env, "env")
    if isinstance(env, str):
        return _adapted(made, env, make, options).with_source(env, id=env)
    return _adapted(made, name_of(made), make, options)


def check_compiled(value: object) -> str | bool:
    """Return `value` if it is "auto", True or False.

    Raises
    ------
    ParameterTypeError
        If it is anything else.
    """
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    if isinstance(value, str) and value == "auto":
        return "auto"
    raise ParameterTypeError(f"compiled must be 'auto', True or False; got {shown(value)}")


def _own_problem(env: Problem | Maze, options: AdapterOptions) -> Problem:
    """Return one of this library's problems, which takes no options."""
    _refuse_bins(options, repr(env))
    if isinstance(env, Problem) and not env.is_compiled:  # it may have been made with this reward
        return env
    _refuse_reward(options, f"a {type(env).__name__}")
    problem = env.to_mdp().with_source(type(env).__name__) if isinstance(env, Maze) else env
    return problem.with_time_limit(STEP_CAP, is_capped=True) if problem.max_episode_steps is None else problem


def _adapted(env: Any, source: str, make: Callable[[], Any] | None, options: AdapterOptions) -> Problem:
    """Return the problem of an environment; one that was made here is closed if it isn't stepped itself."""
    problem, maker, is_ours = None, None, make is not None
    try:
        if make is not None:
            maker = checked_maker(env, make, source)
            is_ours = maker is not None
        if isinstance(env, gymnasium.Env):
            _refuse_reward(options, source)
            problem = _adapted_single(env, source, maker, options)
        else:
            problem = _adapted_parallel(env, source, maker, options)
    finally:
        if is_ours and (problem is None or problem.is_compiled):
            close(env, source)
            if maker is not None:
                maker.close()
    return problem


def _adapted_parallel(env: Any, source: str, make: Callable[[], Any] | None, options: AdapterOptions) -> Problem:
    if options.agents is Agents.INDEPENDENT:
        _refuse_compiled(options, source)
        return PettingZooProblem(env, source, make, bins=options.bins, tries_out=options.tries_out)
    # The joint transitions pay the mean.
    table = _joint_table(env) if options.compiled and _pays_mean(options) else None
    if table is not None:
        _refuse_bins(options, source)
        return _with_agents(_limited(table, table.max_episode_steps, source), env)
    _refuse_compiled(options, source)
    others = None if make is None else lambda: JointEnv(make(), options.reward)
    joint = JointEnv(env, options.reward)
    return GymnasiumProblem(joint, source, others, bins=options.bins, tries_out=options.tries_out)


def _joint_table(env: Any) -> TabularMDP | None:
    """Return the joint transitions that a parallel environment carries; None where a wrapper could change them."""
    layer = env
    while type(layer) is BaseParallelWrapper:  # a subclass may override anything; the base passes all on
        layer = layer.env
    mdp = getattr(layer, "mdp", None)
    if isinstance(layer, BaseParallelWrapper) or not isinstance(mdp, TabularMDP) or not plays_what_it_carries(layer):
        return None
    n_agents = len(layer.possible_agents)
    if len(mdp.action_sizes) != n_agents:
        raise ProblemError(
            f"the mdp of {layer} must have one of its action_sizes for each of the {n_agents} agents; "
            f"got {mdp.action_sizes}"
        )
    return mdp


def _with_agents(table: Problem, env: Any) -> Problem:
    """Return a joint problem that takes what its agents observe, too, where they observe all of its states."""
    joint = JointEnv(env)
    try:
        spaces = AgentSpaces(joint.observation_space, joint.action_space, None)
    except SpaceError:  # a Box, which the table does not need
        return table
    sizes = (spaces.observations.n, spaces.actions.n)
    is_whole = sizes == (table.n_states, table.n_actions)
    return table.with_agents(Team(spaces, joint.readers).decide) if is_whole else table


def _adapted_single(
    env: GymEnvironment, source: str, make: Callable[[], Any] | None, options: AdapterOptions
) -> Problem:
    inner, limit = _without_transparent_wrappers(env)
    others = None if make is None else lambda: _without_transparent_wrappers(make())[0]
    problem = _believed_transitions(inner, source, others, options)
    if problem is None:
        _refuse_compiled(options, source)
        limit = _strictest(limit, _inner_time_limit(inner))
        more: dict[str, Any] = {"bins": options.bins, "tries_out": options.tries_out, "max_episode_steps": limit}
        return GymnasiumProblem(inner, source, others, **more)
    _refuse_bins(options, source)
    return _limited(problem, _strictest(limit, problem.max_episode_steps), source)


def carried_within(env: GymEnvironment) -> Problem | None:
    """Return what an environment carries inside of wrappers that change nothing, be it that of its steps or not.

    Raises
    ------
    ProblemError
        If its table ``P`` has mistakes.
    """
    inner, limit = _without_transparent_wrappers(env)
    problem = None if isinstance(inner, Wrapper) else carried_problem(inner)
    return None if problem is None else _limited(problem, _strictest(limit, problem.max_episode_steps), name_of(env))


def _strictest(*limits: int | None) -> int | None:
    return min((limit for limit in limits if limit is not None), default=None)


def _limited(problem: Problem, limit: int | None, source: str) -> Problem:
    """Return the problem that an environment carries with the environment's time limit, or else with ours."""
    return problem.with_time_limit(limit or STEP_CAP, is_capped=limit is None).with_source(source)


def _without_transparent_wrappers(env: GymEnvironment) -> tuple[GymEnvironment, int | None]:
    """Return what stands inside of the outermost wrappers that change nothing, and the time limit that they set."""
    limits, layer = [], env
    while type(layer) in _TRANSPARENT:  # a subclass may override anything
        if isinstance(layer, TimeLimit):
            limits.append(layer._max_episode_steps)
        layer = layer.env  # type: ignore[attr-defined]  # each of them is a wrapper
    return layer, min(limits, default=None)


def _believed_transitions(
    env: GymEnvironment, source: str, make: Callable[[], Any] | None, options: AdapterOptions
) -> Problem | None:
    """Return the transitions that an environment carries, if they are known to be those of its steps."""
    if not options.compiled or isinstance(env, gymnasium.Wrapper):
        return None
    if plays_what_it_carries(env):
        return carried_problem(env)
    carried = carried_problem(env) if options.compiled is True else None
    if carried is not None:
        check_by_playing(carried, env, source, make)
    return carried


def _inner_time_limit(env: GymEnvironment) -> int | None:
    """Return the time limit that stands below wrappers that pass every step on as one step."""
    limits, layer = [], env
    while isinstance(layer, gymnasium.Wrapper):
        if type(layer) is TimeLimit:
            limits.append(layer._max_episode_steps)
        step = type(layer).step
        is_known = type(layer).__module__.startswith("gymnasium.wrappers.") and not isinstance(layer, _RETIMING)
        if not is_known and step not in _ONE_FOR_ONE:
            break
        layer = layer.env
    return min(limits, default=None)


def _refuse_compiled(options: AdapterOptions, source: str) -> None:
    if options.compiled is True:
        raise NoTableError(
            f"no transition table that is known to be its own steps can be extracted from {source}",
            ", so it cannot be compiled: leave compiled at 'auto', which steps it in Python, or pass a TabularMDP or a "
            "Simulator as env",
        )


def _refuse_bins(options: AdapterOptions, source: str) -> None:
    if options.bins is not None:
        raise ParameterError(f"bins are for environments whose observations are a Box; {source} has states already")


def _pays_mean(options: AdapterOptions) -> bool:
    reward: object = options.reward  # whatever a user gave: arrays compare by entry
    return isinstance(reward, str) and reward == "mean"


def _refuse_reward(options: AdapterOptions, source: str) -> None:
    if not _pays_mean(options):
        raise ParameterError(
            f"team_reward is for PettingZoo environments, whose agents each have a reward; {source} has one reward: "
            f"leave it out (tuckerl.JointEnv takes its own, as reward); got {shown(options.reward)}"
        )
