"""From whatever a user calls an environment to the problem that kernels play."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Any

import gymnasium
import numpy as np
import pettingzoo
from gymnasium.wrappers import OrderEnforcing, PassiveEnvChecker, TimeLimit
from pettingzoo.utils import BaseParallelWrapper

from tuckerl.adapters.gymnasium_problem import GymnasiumProblem
from tuckerl.adapters.joint import JointEnv
from tuckerl.adapters.making import GymEnvironment, Made, make_environment
from tuckerl.adapters.pettingzoo_problem import PettingZooProblem
from tuckerl.adapters.python_world import STEP_CAP
from tuckerl.adapters.transition_tables import extract_transition_table
from tuckerl.errors import ParameterError, ParameterTypeError, ProblemError
from tuckerl.problems.maze import Maze
from tuckerl.problems.mdp import TabularMDP
from tuckerl.problems.simulator import Simulator

Problem = TabularMDP | Simulator | GymnasiumProblem | PettingZooProblem
PROBLEMS = (TabularMDP, Simulator, GymnasiumProblem, PettingZooProblem)
Environment = str | Made | Callable[[], Made] | Problem | Maze

# Wrappers that leave observations, rewards and ends as they are (but for the time limit, which is taken over).
_TRANSPARENT = (TimeLimit, OrderEnforcing, PassiveEnvChecker)


class Agents(Enum):
    """What a learner makes of a PettingZoo environment."""

    INDEPENDENT = "every agent has a table of its own"
    JOINT = "one table over joint observations and joint actions"


@dataclass(frozen=True)
class Reading:
    """How an environment is to be read.

    Parameters
    ----------
    agents : Agents
    bins
        How a Box is cut into bins; see :func:`tuckerl.spaces.encoder.space_encoder`.
    compiled : "auto" or bool
        Whether an environment whose transition table can be extracted is played from it, in compiled code; True refuses
        one where it cannot be.
    reward : str
        A team's: the ``"mean"`` or the ``"sum"`` of its agents' rewards, or one agent's, by its name.
    """

    agents: Agents = Agents.INDEPENDENT
    bins: Any = None
    compiled: str | bool = "auto"
    reward: str = "mean"


def as_problem(env: Environment, reading: Reading = Reading()) -> Problem:  # it is frozen
    """Return what kernels play of `env`.

    A problem of this library is played as it is. An environment is *lifted* into arrays or compiled functions where it
    carries its own: as an attribute ``mdp`` or ``simulator``, or, as Gymnasium's toy-text environments do, as ``P``
    with ``initial_state_distrib``. Only wrappers that change nothing may stand around it: Gymnasium's checker, its
    order enforcer and its time limit, which is taken over. Every other environment is stepped in Python.

    Parameters
    ----------
    env
        A :class:`TabularMDP`, a :class:`Simulator`, a :class:`Maze`; or a Gymnasium environment or a PettingZoo
        parallel environment: by id (Gymnasium's, else PettingZoo's), as an instance, or as a callable that makes one.
    reading : Reading

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
    check_compiled(reading.compiled)
    if isinstance(env, (*PROBLEMS, Maze)):
        if reading.bins is not None:
            raise ParameterError(f"bins are for environments whose observations are a Box; {env!r} has states already")
        if not isinstance(env, (GymnasiumProblem, PettingZooProblem)):  # these may have been read with it
            _refuse_reward(reading, f"a {type(env).__name__}")
        return _maze_table(env) if isinstance(env, Maze) else env
    if isinstance(env, str):
        problem = _read(make_environment(env), env, lambda: make_environment(env), reading)
        if isinstance(problem, (GymnasiumProblem, PettingZooProblem)):
            problem.id = env
        return problem
    if isinstance(env, (gymnasium.Env, pettingzoo.ParallelEnv)):
        return _read(env, _name_of(env), None, reading)
    if callable(env):
        made = env()
        if not isinstance(made, (gymnasium.Env, pettingzoo.ParallelEnv)):
            raise ParameterTypeError(
                f"the callable must make a Gymnasium environment or a PettingZoo parallel environment; it made {made!r}"
            )
        return _read(made, _name_of(made), env, reading)
    raise ParameterTypeError(
        f"env must be a Gymnasium environment, a PettingZoo parallel environment, the id of one, a callable that makes "
        f"one, a TabularMDP, a Simulator or a Maze; got {env!r}"
    )


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


def _refuse_compiled(reading: Reading, source: str) -> None:
    if reading.compiled is True:
        raise ProblemError(
            f"no transition table can be extracted from {source}, so it cannot be compiled: leave compiled at 'auto', "
            "which steps it in Python"
        )


def _maze_table(maze: Maze) -> TabularMDP:
    table = maze.to_mdp()
    table.source = type(maze).__name__
    return table


def _name_of(env: Any) -> str:
    specification = getattr(env, "spec", None)
    return str(getattr(specification, "id", None) or type(env.unwrapped).__name__)


def _read(env: Any, source: str, make: Callable[[], Any] | None, reading: Reading) -> Problem:
    """Read an environment; one that was made here and whose transitions were taken, or that is refused, is closed."""
    problem = None
    try:
        if isinstance(env, gymnasium.Env):
            _refuse_reward(reading, source)
            problem = _read_single(env, source, make, reading)
        else:
            problem = _read_parallel(env, source, make, reading)
    finally:
        if make is not None and not isinstance(problem, (GymnasiumProblem, PettingZooProblem)):
            env.close()
    return problem


def _read_parallel(env: Any, source: str, make: Callable[[], Any] | None, reading: Reading) -> Problem:
    if reading.agents is Agents.INDEPENDENT:
        _refuse_compiled(reading, source)
        return PettingZooProblem(env, source, make, bins=reading.bins)
    # The joint transitions pay the mean.
    table = _joint_table(env) if reading.compiled and reading.reward == "mean" else None
    if table is not None:
        _refuse_bins(reading, source)
        return _limited(table, table.max_episode_steps, source)
    _refuse_compiled(reading, source)
    others = None if make is None else lambda: JointEnv(make(), reading.reward)
    return GymnasiumProblem(JointEnv(env, reading.reward), source, others, bins=reading.bins)


def _joint_table(env: Any) -> TabularMDP | None:
    """Return the joint transitions that a parallel environment carries; None where a wrapper may change them."""
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


def _read_single(env: GymEnvironment, source: str, make: Callable[[], Any] | None, reading: Reading) -> Problem:
    inner, limit = _without_transparent_wrappers(env)
    problem = _own_problem(inner) if reading.compiled and not isinstance(inner, gymnasium.Wrapper) else None
    if problem is None:
        _refuse_compiled(reading, source)
        others = None if make is None else lambda: _without_transparent_wrappers(make())[0]
        return GymnasiumProblem(inner, source, others, bins=reading.bins, max_episode_steps=limit)
    _refuse_bins(reading, source)
    limits = [steps for steps in (limit, problem.max_episode_steps) if steps is not None]
    return _limited(problem, min(limits, default=None), source)


def _limited(problem: TabularMDP | Simulator, limit: int | None, source: str) -> TabularMDP | Simulator:
    """Return the problem of an environment with its time limit, or else with ours; it remembers its environment."""
    limited = problem.with_time_limit(limit or STEP_CAP)  # a new one: the environment's own stays as it is
    limited.is_capped, limited.source = limit is None, source
    return limited


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


def _own_problem(env: GymEnvironment) -> TabularMDP | Simulator | None:
    """Return the transitions that an environment carries."""
    if _is_altered(env):
        return None
    problem = getattr(env, "mdp", None) or getattr(env, "simulator", None)
    return problem if isinstance(problem, (TabularMDP, Simulator)) else extract_transition_table(env)


def _refuse_bins(reading: Reading, source: str) -> None:
    if reading.bins is not None:
        raise ParameterError(f"bins are for environments whose observations are a Box; {source} has states already")


def _refuse_reward(reading: Reading, source: str) -> None:
    if reading.reward != "mean":
        raise ParameterError(
            f"team_reward is for PettingZoo environments, whose agents each have a reward; {source} has one reward: "
            f"leave it out (tuckerl.JointEnv takes its own, as reward); got {reading.reward!r}"
        )
