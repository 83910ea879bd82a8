"""How kernels play a problem, whatever its kind: begin an episode, take a step, know when to stop.

Each kind of problem lists its kernels here, in its own file, under the type of its arrays. The choice between them is
made when a caller is compiled, so it costs nothing while it plays.
"""

from collections.abc import Callable
from typing import Any

from tuckerl._jit import ByKind, is_ours, kernel, recompiled
from tuckerl.checks import check_function
from tuckerl.types import Stream

WorldArrays = Any
"""What kernels read of a world: the NamedTuple of its kind."""

TERMINATED, TRUNCATED = 1, 2
"""How an episode ends: with the return, or without."""

_RESET: dict[type, Callable[..., int]] = {}
_STEP: dict[type, Callable[..., tuple[int, float, bool]]] = {}
_STEP_TOGETHER: dict[type, Callable[..., None]] = {}
_IS_OUT_OF_TIME: dict[type, Callable[..., bool]] = {}
_MUST_RETURN: dict[type, Callable[..., bool]] = {}
_IS_POSSIBLE: dict[type, Callable[..., bool]] = {}

reset = ByKind(_RESET)
"""``reset(world, rng)`` returns the first state of an episode."""

step = ByKind(_STEP)
"""``step(world, state, action, rng)`` returns the next state, the reward, and whether the return ends there."""

step_together = ByKind(_STEP_TOGETHER)
"""``step_together(world, begin)`` begins an episode of all agents, or takes a step with all their actions."""

is_out_of_time = ByKind(_IS_OUT_OF_TIME)
"""``is_out_of_time(world, steps)`` returns whether the episode is truncated after so many steps."""

must_return = ByKind(_MUST_RETURN)
"""``must_return(world)`` returns whether the kernel must return: something is wrong, or Python is to be asked."""


is_possible = ByKind(_IS_POSSIBLE)
"""``is_possible(world, state, n_states)`` returns whether a state is one; of the library's own kinds it always is."""


@kernel
def _never_strays(world: WorldArrays, state: int, n_states: int) -> bool:
    """Return True: the library's own kinds give states only."""
    return True


@kernel
def _is_in_range(world: WorldArrays, state: int, n_states: int) -> bool:
    """Return whether a state is a row of the table."""
    return 0 <= state < n_states


def _compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a user's function as a kernel; ours, which is one, as it is."""
    return function if is_ours(function) else recompiled(function)


def _guarded_reset(reset: Callable[..., int]) -> Callable[..., int]:
    """Return a user's `reset` so that an error in it reads as state -1; ours as it is."""
    if is_ours(reset):
        return reset
    inner = recompiled(reset)

    @kernel
    def guarded(world: WorldArrays, rng: Stream) -> int:
        """Return a first state.

        Parameters
        ----------
        world : NamedTuple
        rng : (4,) uint64
            The agent's stream.
        """
        state = -1
        try:
            state = int(inner(world, rng))
        except Exception:  # noqa: BLE001  # whatever a user's kernel raises; Numba knows no other clause
            state = -1
        return state

    return guarded


def _guarded_step(step: Callable[..., tuple[int, float, bool]]) -> Callable[..., tuple[int, float, bool]]:
    """Return a user's `step` so that an error in it reads as state -1; ours as it is."""
    if is_ours(step):
        return step
    inner = recompiled(step)

    @kernel
    def guarded(world: WorldArrays, state: int, action: int, rng: Stream) -> tuple[int, float, bool]:
        """Return what came of a step.

        Parameters
        ----------
        world : NamedTuple
        state, action : int
        rng : (4,) uint64
            The agent's stream.
        """
        next_state, reward, terminated = -1, 0.0, True
        try:
            answer = inner(world, state, action, rng)
            next_state, reward, terminated = int(answer[0]), float(answer[1]), bool(answer[2])
        except Exception:  # noqa: BLE001  # as above
            next_state = -1
        return next_state, reward, terminated

    return guarded


def _guarded_step_together(step_together: Callable[..., None]) -> Callable[..., None]:
    """Return a user's `step_together` so that an error in it reads as state -1 of all agents; ours as it is."""
    if is_ours(step_together):
        return step_together
    inner = recompiled(step_together)

    @kernel
    def guarded(world: WorldArrays, begin: bool) -> None:
        """Let all agents begin or act."""
        try:
            inner(world, begin)
        except Exception:  # noqa: BLE001  # as above
            world.state[:] = -1

    return guarded


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

    Raises
    ------
    ParameterError, ParameterTypeError
        If a kernel takes other arguments, or is no function.
    """
    check_function("reset", reset, "world, rng")
    check_function("step", step, "world, state, action, rng")
    check_function("is_out_of_time", is_out_of_time, "world, steps")
    check_function("must_return", must_return, "world")
    _RESET[arrays], _STEP[arrays] = _guarded_reset(reset), _guarded_step(step)
    _IS_POSSIBLE[arrays] = _never_strays if is_ours(arrays) else _is_in_range
    _IS_OUT_OF_TIME[arrays], _MUST_RETURN[arrays] = _compiled(is_out_of_time), _compiled(must_return)


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

    Raises
    ------
    ParameterError, ParameterTypeError
        If a kernel takes other arguments, or is no function.
    """
    check_function("step_together", step_together, "world, begin")
    check_function("must_return", must_return, "world")
    _STEP_TOGETHER[arrays], _MUST_RETURN[arrays] = _guarded_step_together(step_together), _compiled(must_return)
    _IS_POSSIBLE[arrays] = _never_strays if is_ours(arrays) else _is_in_range
