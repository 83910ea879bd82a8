"""From whatever a user calls an environment to the problem that kernels play."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Any

import gymnasium
import numpy as np
from gymnasium.wrappers import OrderEnforcing, PassiveEnvChecker, TimeLimit
from pettingzoo.utils import BaseParallelWrapper

from tuckerl.adapters.gymnasium_problem import GymnasiumProblem
from tuckerl.adapters.joint import JointEnv
from tuckerl.adapters.making import GymEnvironment, Made, made_of, name_of
from tuckerl.adapters.pettingzoo_problem import PettingZooProblem
from tuckerl.adapters.python_problem import AgentSpaces
from tuckerl.adapters.team import Team
from tuckerl.adapters.transition_tables import extract_transition_table
from tuckerl.errors import ParameterError, ParameterTypeError, ProblemError, SpaceError
from tuckerl.problems.maze import Maze
from tuckerl.problems.mdp import TabularMDP
from tuckerl.problems.parts import STEP_CAP
from tuckerl.problems.problem import Problem

Environment = str | Made | Callable[[], Made] | Problem | Maze

# Wrappers that leave observations, rewards and ends as they are (but for the time limit, which is taken over).
_TRANSPARENT = (TimeLimit, OrderEnforcing, PassiveEnvChecker)


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
    """

    agents: Agents = Agents.INDEPENDENT
    bins: Any = None
    compiled: str | bool = "auto"
    reward: str = "mean"


def as_problem(env: Environment, options: AdapterOptions = AdapterOptions()) -> Problem:  # it is frozen
    """Return the problem that kernels play for an environment.

    A problem of this library is played as it is. Of an environment that carries its transitions, these are extracted
    and played in compiled code: a :class:`TabularMDP` in its attribute ``mdp``, a :class:`Simulator` in ``simulator``,
    or, as in Gymnasium's toy-text environments, a table ``P`` with ``initial_state_distrib``. Only wrappers that change
    nothing may stand around it: Gymnasium's checker, its order enforcer and its time limit, which is taken over. Every
    other environment is stepped in Python. Where there is no time limit, episodes are cut off after 100,000 steps.

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
        If it does not begin, or its joint actions do not belong to its agents.
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
    if value == "auto":
        return "auto"
    raise ParameterTypeError(f"compiled must be 'auto', True or False; got {value!r}")


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
    problem = None
    try:
        if isinstance(env, gymnasium.Env):
            _refuse_reward(options, source)
            problem = _adapted_single(env, source, make, options)
        else:
            problem = _adapted_parallel(env, source, make, options)
    finally:
        if make is not None and (problem is None or problem.is_compiled):
            env.close()
    return problem


def _adapted_parallel(env: Any, source: str, make: Callable[[], Any] | None, options: AdapterOptions) -> Problem:
    if options.agents is Agents.INDEPENDENT:
        _refuse_compiled(options, source)
        return PettingZooProblem(env, source, make, bins=options.bins)
    # The joint transitions pay the mean.
    table = _joint_table(env) if options.compiled and options.reward == "mean" else None
    if table is not None:
        _refuse_bins(options, source)
        return _with_agents(_limited(table, table.max_episode_steps, source), env)
    _refuse_compiled(options, source)
    others = None if make is None else lambda: JointEnv(make(), options.reward)
    return GymnasiumProblem(JointEnv(env, options.reward), source, others, bins=options.bins)


def _joint_table(env: Any) -> TabularMDP | None:
    """Return the joint transitions that a parallel environment carries; None where a wrapper could change them."""
    layer = env
    while type(layer) is BaseParallelWrapper:  # a subclass may override anything; the base passes all on
        layer = layer.env
    mdp = getattr(layer, "mdp", None)
    if isinstance(layer, BaseParallelWrapper) or not isinstance(mdp, TabularMDP) or _is_altered(layer):
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
    problem = _carried_problem(inner) if options.compiled and not isinstance(inner, gymnasium.Wrapper) else None
    if problem is None:
        _refuse_compiled(options, source)
        others = None if make is None else lambda: _without_transparent_wrappers(make())[0]
        return GymnasiumProblem(inner, source, others, bins=options.bins, max_episode_steps=limit)
    _refuse_bins(options, source)
    limits = [steps for steps in (limit, problem.max_episode_steps) if steps is not None]
    return _limited(problem, min(limits, default=None), source)


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


def _is_altered(env: Any) -> bool:
    """Return whether a user has changed what one of this library's environments does, but perhaps not its arrays."""
    own = any(kind.__module__.startswith("tuckerl.") for kind in type(env).__mro__)
    methods = [getattr(env, name) for name in ("reset", "step")]
    return own and not all(getattr(method, "__module__", "").startswith("tuckerl.") for method in methods)


def _carried_problem(env: GymEnvironment) -> Problem | None:
    """Return the transitions that an environment carries."""
    if _is_altered(env):
        return None
    for name in ("mdp", "simulator"):  # an attribute of that name may be something else
        problem = getattr(env, name, None)
        if isinstance(problem, Problem) and problem.is_compiled:
            return problem
    return extract_transition_table(env)


def _refuse_compiled(options: AdapterOptions, source: str) -> None:
    if options.compiled is True:
        raise ProblemError(
            f"no transition table can be extracted from {source}, so it cannot be compiled: leave compiled at 'auto', "
            "which steps it in Python"
        )


def _refuse_bins(options: AdapterOptions, source: str) -> None:
    if options.bins is not None:
        raise ParameterError(f"bins are for environments whose observations are a Box; {source} has states already")


def _refuse_reward(options: AdapterOptions, source: str) -> None:
    if options.reward != "mean":
        raise ParameterError(
            f"team_reward is for PettingZoo environments, whose agents each have a reward; {source} has one reward: "
            f"leave it out (tuckerl.JointEnv takes its own, as reward); got {options.reward!r}"
        )
