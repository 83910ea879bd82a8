"""From whatever a user calls an environment to the problem that a kernel plays."""

from collections.abc import Callable, Sequence
from importlib import import_module
from typing import Any, Protocol

import gymnasium
import pettingzoo
from gymnasium.wrappers import OrderEnforcing, PassiveEnvChecker, TimeLimit
from pettingzoo.utils import BaseParallelWrapper

from tuckerl.checks import check_name
from tuckerl.errors import ParameterTypeError, ProblemError, UnknownNameError
from tuckerl.problems.maze import Maze
from tuckerl.problems.mdp import TabularMDP
from tuckerl.problems.simulator import Simulator

GymEnvironment = gymnasium.Env[Any, Any]


class ParallelEnvironment(Protocol):
    """A PettingZoo parallel environment that carries its joint transitions.

    PettingZoo's own class would do, but it is `Any` to the type checker, and a union with that checks nothing.
    """

    mdp: TabularMDP

    @property
    def possible_agents(self) -> Sequence[Any]:
        """All agents, in the order in which their actions make a joint action."""

    def close(self) -> None:
        """Let go of what the environment holds."""


Problem = TabularMDP | Simulator
Made = GymEnvironment | ParallelEnvironment
Environment = str | Made | Callable[[], Made] | Problem | Maze

# Wrappers that leave observations, rewards and ends as they are (but for the time limit, which is taken over).
_TRANSPARENT = (TimeLimit, OrderEnforcing, PassiveEnvChecker)


def as_problem(env: Environment, *, teams: bool = True) -> Problem:
    """Return what kernels play of `env`.

    Parameters
    ----------
    env
        A :class:`TabularMDP`, a :class:`Simulator`, a :class:`Maze`; a Gymnasium environment that carries one of the
        first two as its attribute ``mdp`` or ``simulator``; or a PettingZoo parallel environment whose ``mdp`` is a
        :class:`TabularMDP` of joint states and joint actions. Environments: by id (Gymnasium's, else PettingZoo's), as
        an instance, or as a callable that makes one.
    teams : bool
        Whether a parallel environment may be played, by its joint actions.

    Raises
    ------
    UnknownNameError
        If no environment has this id.
    ProblemError
        If the environment carries neither, a wrapper changes what it does, or its joint actions do not belong to its
        agents.
    """
    if isinstance(env, (TabularMDP, Simulator)):
        return env
    if isinstance(env, Maze):
        return env.to_mdp()
    if isinstance(env, str):
        return _lift_and_close(_make(env), teams)
    if isinstance(env, (gymnasium.Env, pettingzoo.ParallelEnv)):
        return _lift(env, teams)
    if callable(env):
        made = env()
        if not isinstance(made, (gymnasium.Env, pettingzoo.ParallelEnv)):
            raise ParameterTypeError(
                f"the callable must make a Gymnasium environment or a PettingZoo parallel environment; it made {made!r}"
            )
        return _lift_and_close(made, teams)
    raise ParameterTypeError(
        f"env must be a Gymnasium environment, a PettingZoo parallel environment, the id of one, a callable that makes "
        f"one, a TabularMDP, a Simulator or a Maze; got {env!r}"
    )


def _make(name: str) -> Made:
    """Return the environment of this id; "module:id" imports what registers the id first."""
    module, _, plain = name.rpartition(":")
    if module:
        try:
            import_module(module)
        except ModuleNotFoundError as error:
            raise UnknownNameError(f"unknown environment {name!r}: there is no module {module!r} to import") from error
    check_name("environment", plain, {*gymnasium.registry, *pettingzoo.parallel_registry})
    if plain in gymnasium.registry:
        return gymnasium.make(plain, disable_env_checker=True)
    made: ParallelEnvironment = pettingzoo.make("parallel", plain)
    return made


def _lift_and_close(env: Made, teams: bool) -> Problem:
    try:
        return _lift(env, teams)
    finally:
        env.close()


def _lift(env: Made, teams: bool) -> Problem:
    if isinstance(env, gymnasium.Env):
        return _lift_single(env)
    if not teams:
        raise ProblemError(f"{env} is an environment of several agents: learn on it with tuckerl.TeamQ")
    return _lift_parallel(env)


def _lift_parallel(env: Any) -> TabularMDP:
    layer = env
    while isinstance(layer, BaseParallelWrapper):
        if type(layer) is not BaseParallelWrapper:  # a subclass may override anything; the base passes all on
            raise _may_change(layer, env)
        layer = layer.env
    mdp = getattr(layer, "mdp", None)
    if not isinstance(mdp, TabularMDP):
        raise ProblemError(
            f"{layer} does not carry its joint transitions as an attribute `mdp`: describe it as a tuckerl.TabularMDP"
        )
    n_agents = len(layer.possible_agents)
    if len(mdp.action_sizes) != n_agents:
        raise ProblemError(
            f"the mdp of {layer} must have one of its action_sizes for each of the {n_agents} agents; "
            f"got {mdp.action_sizes}"
        )
    return mdp


def _may_change(wrapper: Any, env: Any) -> ProblemError:
    return ProblemError(
        f"the wrapper {type(wrapper).__name__} may change what {env.unwrapped} does, so its transitions cannot "
        "be taken from it: learn on the environment without it"
    )


def _lift_single(env: GymEnvironment) -> Problem:
    limits = []
    layer: GymEnvironment = env
    while isinstance(layer, gymnasium.Wrapper):
        if type(layer) not in _TRANSPARENT:  # a subclass may override anything
            raise _may_change(layer, env)
        if isinstance(layer, TimeLimit):
            limits.append(layer._max_episode_steps)
        layer = layer.env
    problem = getattr(layer, "mdp", None) or getattr(layer, "simulator", None)
    if not isinstance(problem, (TabularMDP, Simulator)):
        raise ProblemError(
            f"{layer} carries neither its transitions as an attribute `mdp` nor compiled functions as `simulator`: "
            "describe it as a tuckerl.TabularMDP or a tuckerl.Simulator"
        )
    if problem.max_episode_steps is not None:
        limits.append(problem.max_episode_steps)
    return problem.with_time_limit(min(limits)) if limits else problem
