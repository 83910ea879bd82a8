"""From whatever a user calls an environment to the problem that a kernel plays."""

from collections.abc import Callable
from typing import Any

import gymnasium
from gymnasium.wrappers import OrderEnforcing, PassiveEnvChecker, TimeLimit

from tuckerl.checks import check_name
from tuckerl.errors import ParameterTypeError, ProblemError
from tuckerl.problems.maze import Maze
from tuckerl.problems.mdp import TabularMDP
from tuckerl.problems.simulator import Simulator

GymEnvironment = gymnasium.Env[Any, Any]
Problem = TabularMDP | Simulator
Environment = str | GymEnvironment | Callable[[], GymEnvironment] | Problem | Maze

# Wrappers that leave observations, rewards and ends as they are (but for the time limit, which is taken over).
_TRANSPARENT = (TimeLimit, OrderEnforcing, PassiveEnvChecker)


def as_problem(env: Environment) -> Problem:
    """Return what kernels play of `env`.

    Parameters
    ----------
    env
        A :class:`TabularMDP`, a :class:`Simulator`, a :class:`Maze`, or a Gymnasium environment that carries one
        of the first two as its attribute ``mdp`` or ``simulator``: by id, as an instance, or as a callable that
        makes one.

    Raises
    ------
    UnknownNameError
        If no environment has this id.
    ProblemError
        If the environment carries neither, or a wrapper changes what it does.
    """
    if isinstance(env, (TabularMDP, Simulator)):
        return env
    if isinstance(env, Maze):
        return env.to_mdp()
    if isinstance(env, str):
        if ":" not in env:  # "module:id" imports what registers the id first; Gymnasium sees to it
            check_name("environment", env, gymnasium.registry)
        return _lift_and_close(gymnasium.make(env, disable_env_checker=True))
    if isinstance(env, gymnasium.Env):
        return _lift(env)
    if callable(env):
        made = env()
        if not isinstance(made, gymnasium.Env):
            raise ParameterTypeError(f"the callable must make a Gymnasium environment; it made {made!r}")
        return _lift_and_close(made)
    raise ParameterTypeError(
        f"env must be a Gymnasium id or environment, a callable that makes one, a TabularMDP, "
        f"a Simulator or a Maze; got {env!r}"
    )


def _lift_and_close(env: GymEnvironment) -> Problem:
    try:
        return _lift(env)
    finally:
        env.close()


def _lift(env: GymEnvironment) -> Problem:
    limits = []
    layer: GymEnvironment = env
    while isinstance(layer, gymnasium.Wrapper):
        if type(layer) not in _TRANSPARENT:  # a subclass may override anything
            raise ProblemError(
                f"the wrapper {type(layer).__name__} may change what {env.unwrapped} does, so its transitions cannot "
                "be taken from it: learn on the environment without it"
            )
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
