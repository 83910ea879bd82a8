"""Environments in which a learner is judged: another than the one it learns in, or one that shows itself."""

from dataclasses import replace
from typing import Any

import gymnasium
from pettingzoo.utils import BaseParallelWrapper

from tuckerl.adapters.making import made_of, make_environment
from tuckerl.adapters.python_problem import PythonProblem
from tuckerl.adapters.resolve import AdapterOptions, Environment, as_problem
from tuckerl.errors import ParameterError, SpaceError
from tuckerl.problems.maze import Maze
from tuckerl.problems.problem import Problem


class _ShownEnv(gymnasium.Wrapper[Any, Any, Any, Any]):
    """Renders after each reset and each step."""

    def reset(self, **keywords: Any) -> Any:
        """Begin an episode and render."""
        result = self.env.reset(**keywords)
        self.env.render()
        return result

    def step(self, action: Any) -> Any:
        """Take a step and render."""
        result = self.env.step(action)
        self.env.render()
        return result


class _ShownParallelEnv(BaseParallelWrapper):  # type: ignore[misc]  # PettingZoo's class is Any to the type checker
    """Renders after each reset and each step."""

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        """Begin an episode and render."""
        result = self.env.reset(seed=seed, options=options)
        self.env.render()
        return result

    def step(self, actions: dict[Any, Any]) -> Any:
        """Take a step and render."""
        result = self.env.step(actions)
        self.env.render()
        return result


def judged_in(learned: Problem, env: Environment | None, options: AdapterOptions, *, render: bool) -> Problem:
    """Return the problem in which a learner is judged.

    Parameters
    ----------
    learned : Problem
        The one that it learns in.
    env : optional
        Another one; by default the learned one, or, if it is to be shown, one made again.
    options : AdapterOptions
        How the learner reads its environment.
    render : bool
        Whether it is to be shown.

    Raises
    ------
    ParameterError
        If its spaces are others, or it cannot be shown.
    """
    if env is None and not render:
        return learned
    if env is not None and isinstance(env, (Problem, Maze)):
        if render:
            raise ParameterError(_cannot_show(env))
        problem = as_problem(env)
    else:
        stepped: Any = _to_show(learned) if env is None else env
        problem = _stepped(stepped, learned, options, render=render, is_ours=env is None)
    difference = learned.difference_of_spaces(problem)
    if difference:
        raise ParameterError(_other_spaces(learned, difference))
    return problem


def _stepped(env: Any, learned: Problem, options: AdapterOptions, *, render: bool, is_ours: bool) -> Problem:
    """Return the problem of an environment that Python steps, as wrappers and renderers must see every step.

    Its world closes it where it is ours: made here, by an id or a callable, or copied.
    """
    bins = learned.edges if isinstance(learned, PythonProblem) else None
    options = replace(options, bins=bins, compiled=False, tries_out=False)
    made, make = made_of(env, "env")
    shown = _shown(made) if render else made
    try:
        problem: Any = as_problem(shown, options)
    except (SpaceError, ParameterError) as error:  # the bins belong to another space
        raise ParameterError(
            f"env must have the spaces of the one that was learned, {learned.source}: {error}"
        ) from error
    return problem.made_for_us() if is_ours or make is not None else problem


def _to_show(learned: Problem) -> Any:
    """Return an environment like the learned one that can be shown."""
    if learned.id is not None:
        return make_environment(learned.id, {"render_mode": "human"})
    if isinstance(learned, PythonProblem):
        world: Any = learned.world()
        return world.env
    raise ParameterError(_cannot_show(learned))


def _shown(env: Any) -> Any:
    """Return an environment that renders at every step: by itself, where that is its mode."""
    mode = getattr(env, "render_mode", None)
    if mode is None:
        raise ParameterError(_cannot_show(env))
    if mode == "human":
        return env
    if not isinstance(env, gymnasium.Env):
        return _ShownParallelEnv(env)
    return _ShownEnv(env)


def _other_spaces(learned: Problem, difference: str) -> str:
    return f"env must have the spaces of the one that was learned, {learned.source}: {difference}"


def _cannot_show(env: object) -> str:
    return (
        "render=True needs an environment that was made to be shown: pass "
        f"env=gymnasium.make(..., render_mode='human'); {env} has no render_mode"
    )
