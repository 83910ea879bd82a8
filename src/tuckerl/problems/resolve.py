"""From whatever a user calls an environment to the problem that a kernel plays."""

from collections.abc import Callable
from typing import Any

import gymnasium
from gymnasium.wrappers import OrderEnforcing, PassiveEnvChecker, TimeLimit

from tuckerl.checks import check_name
from tuckerl.errors import ParameterTypeError, ProblemError
from tuckerl.problems.maze import Maze
from tuckerl.problems.mdp import TabularMDP

GymEnvironment = gymnasium.Env[Any, Any]
Environment = str | GymEnvironment | Callable[[], GymEnvironment] | TabularMDP | Maze

# Wrappers that leave observations, rewards and ends as they are (but for the time limit, which is taken over).
_TRANSPARENT = (TimeLimit, OrderEnforcing, PassiveEnvChecker)


def as_problem(env: Environment) -> TabularMDP:
    """Return the finite MDP behind `env`.

    Parameters
    ----------
    env
        A :class:`TabularMDP`, a :class:`Maze`, or a Gymnasium environment that carries its own transitions in
        ``mdp``: by id, as an instance, or as a callable that makes one.

    Raises
    ------
    UnknownNameError
        If no environment has this id.
    ProblemError
        If the environment carries no transitions, or a wrapper changes what it does.
    """
    if isinstance(env, TabularMDP):
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
        f"env must be a Gymnasium id or environment, a callable that makes one, a TabularMDP or a Maze; got {env!r}"
    )


def _lift_and_close(env: GymEnvironment) -> TabularMDP:
    try:
        return _lift(env)
    finally:
        env.close()


def _lift(env: GymEnvironment) -> TabularMDP:
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
    mdp = getattr(layer, "mdp", None)
    if not isinstance(mdp, TabularMDP):
        raise ProblemError(
            f"{layer} does not carry its transitions as an attribute `mdp`: describe it as a tuckerl.TabularMDP"
        )
    if mdp.max_episode_steps is not None:
        limits.append(mdp.max_episode_steps)
    return mdp.with_time_limit(min(limits)) if limits else mdp
