"""How kernels play a problem, whatever its kind: begin an episode, take a step, know when to stop.

Each kind of problem lists its kernels here, in its own file, under the type of its arrays. The choice between them is
made when a caller is compiled, so it costs nothing while it plays.
"""

from collections.abc import Callable
from typing import Any

from tuckerl._jit import by_kind, kernel

WorldArrays = Any
"""What kernels read of a world: the NamedTuple of its kind."""

TERMINATED, TRUNCATED = 1, 2
"""How an episode ends: with the return, or without."""

_RESET: dict[type, Callable[..., int]] = {}
_STEP: dict[type, Callable[..., tuple[int, float, bool]]] = {}
_STEP_TOGETHER: dict[type, Callable[..., None]] = {}
_IS_OUT_OF_TIME: dict[type, Callable[..., bool]] = {}
_MUST_RETURN: dict[type, Callable[..., bool]] = {}

reset = by_kind(_RESET)
"""``reset(world, rng)`` returns the first state of an episode."""

step = by_kind(_STEP)
"""``step(world, state, action, rng)`` returns the next state, the reward, and whether the return ends there."""

step_together = by_kind(_STEP_TOGETHER)
"""``step_together(world, begin)`` begins an episode of all agents, or takes a step with all their actions."""

is_out_of_time = by_kind(_IS_OUT_OF_TIME)
"""``is_out_of_time(world, steps)`` returns whether the episode is truncated after so many steps."""

must_return = by_kind(_MUST_RETURN)
"""``must_return(world)`` returns whether the kernel must return: something is wrong, or Python is to be asked."""


@kernel
def _reaches_limit(world: WorldArrays, steps: int) -> bool:
    """Return whether an episode of so many steps is truncated."""
    return steps >= world.max_episode_steps


@kernel
def _plays_on(world: WorldArrays) -> bool:
    """Return False: nothing interrupts this kind."""
    return False


def register_dynamics(
    arrays: type,
    *,
    reset: Callable[..., int],
    step: Callable[..., tuple[int, float, bool]],
    is_out_of_time: Callable[..., bool] = _reaches_limit,
    must_return: Callable[..., bool] = _plays_on,
) -> None:
    """List the kernels of a kind of problem that one agent plays.

    Parameters
    ----------
    arrays : type
        The NamedTuple that kernels read of a world.
    reset : kernel ``(world, rng) -> state``
    step : kernel ``(world, state, action, rng) -> (next state, reward, terminated)``
    is_out_of_time : kernel ``(world, steps) -> bool``, optional
        Default: whether `steps` have reached ``world.max_episode_steps``.
    must_return : kernel ``(world) -> bool``, optional
        Default: never.
    """
    _RESET[arrays], _STEP[arrays] = reset, step
    _IS_OUT_OF_TIME[arrays], _MUST_RETURN[arrays] = is_out_of_time, must_return


def register_shared_dynamics(
    arrays: type, *, step_together: Callable[..., None], must_return: Callable[..., bool] = _plays_on
) -> None:
    """List the kernels of a kind of problem whose agents act in one world.

    Parameters
    ----------
    arrays : type
        The NamedTuple that kernels read of a world of N agents. It has the fields ``before``, ``state``, ``action`` and
        ``end``, (N,) int64 (``end``: 0, `TERMINATED` or `TRUNCATED`), ``reward``, (N,) float64, ``playing``, (N,) bool,
        and the number ``max_episode_steps``.
    step_together : kernel ``(world, begin) -> None``
        Begins an episode or lets all playing agents act; changes all of these but ``action``.
    must_return : kernel ``(world) -> bool``, optional
        Default: never.
    """
    _STEP_TOGETHER[arrays], _MUST_RETURN[arrays] = step_together, must_return
