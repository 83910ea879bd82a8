"""Problems that are compiled functions instead of tables: a few numbers that move, and the table's row they fall into.

Three functions of fixed signatures describe one::

    reset(parameters, state, rng)                                 put the first state into `state`
    step(parameters, state, action, rng) -> (reward, terminated)  move `state` in place
    index(parameters, state) -> int                               the row of the Q-table, from 0 to n_states - 1

`parameters` and `state` are float64 arrays, `rng` is a (4,) uint64 stream for :func:`tuckerl.rng.uniform`. The
functions are compiled: they use numbers, arrays and ``math``, and make no arrays. All simulators share the learners'
compiled kernels, because kernels know the signatures and not the functions.
"""

from collections.abc import Callable
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tuckerl._jit import compiled_function
from tuckerl.checks import check_int
from tuckerl.errors import ParameterTypeError, ProblemError, SimulatorError
from tuckerl.problems.mdp import NO_LIMIT, check_heuristic
from tuckerl.types import FloatArray, Stream

Reset = Callable[[FloatArray, FloatArray, Stream], None]
Step = Callable[[FloatArray, FloatArray, int, Stream], tuple[float, bool]]
Index = Callable[[FloatArray, FloatArray], int]

# What `fault` holds once a function has returned something impossible.
KIND, FROM_STATE, ACTION, STEP, TO_STATE, REWARD = range(6)
OUT_OF_RANGE, NOT_FINITE = 1.0, 2.0


class SimulatorArrays(NamedTuple):
    """What kernels read of a simulator."""

    reset: Any  # compiled
    step: Any
    index: Any
    parameters: FloatArray
    state: FloatArray  # changed in place: one for each agent
    fault: FloatArray  # (6,) the first impossible thing that a function returned, all 0 while there is none
    clock: FloatArray  # (1,) steps since the latest reset
    n_states: int
    n_actions: int
    max_episode_steps: int  # NO_LIMIT where there is none


class Simulator:
    """A problem given by compiled functions.

    Parameters
    ----------
    reset, step, index : functions
        As the module's documentation says.
    n_states, n_actions, state_size : int
        Rows and columns of the Q-table, and length of the state array.
    parameters : (P,) float, optional
        Numbers that the functions read.
    max_episode_steps : int, optional
        An episode is truncated after as many steps; default: never.
    heuristic : (n_states,) float, optional
        What ``DynaH`` uses by default.

    Raises
    ------
    ParameterError, ParameterTypeError
        If a number is impossible or a function is none.
    """

    def __init__(
        self,
        reset: Reset,
        step: Step,
        index: Index,
        *,
        n_states: int,
        n_actions: int,
        state_size: int,
        parameters: ArrayLike = (),
        max_episode_steps: int | None = None,
        heuristic: ArrayLike | None = None,
    ) -> None:
        for name, function in (("reset", reset), ("step", step), ("index", index)):
            if not callable(function):
                raise ParameterTypeError(f"{name} must be a function; got {function!r}")
        self.functions = (reset, step, index)
        self.n_states = check_int("n_states", n_states, 1)
        self.n_actions = check_int("n_actions", n_actions, 1)
        self.state_size = check_int("state_size", state_size, 1)
        self.parameters: FloatArray = np.array(parameters, dtype=np.float64).reshape(-1)
        if not np.isfinite(self.parameters).all():
            raise ProblemError(f"parameters must be finite numbers; got {self.parameters}")
        if max_episode_steps is not None:
            max_episode_steps = check_int("max_episode_steps", max_episode_steps, 1)
        self.max_episode_steps = max_episode_steps
        self.heuristic = None if heuristic is None else check_heuristic(heuristic, self.n_states)

    @cached_property
    def _compiled(self) -> tuple[Any, Any, Any]:
        reset, step, index = self.functions
        return compiled_function(reset, "reset"), compiled_function(step, "step"), compiled_function(index, "index")

    def world(self) -> SimulatorArrays:
        """Return one agent's copy, as kernels read it."""
        return SimulatorArrays(
            *self._compiled,
            parameters=self.parameters,
            state=np.zeros(self.state_size),
            fault=np.zeros(6),
            clock=np.zeros(1),
            n_states=self.n_states,
            n_actions=self.n_actions,
            max_episode_steps=self.max_episode_steps or NO_LIMIT,
        )

    def with_time_limit(self, max_episode_steps: int | None) -> "Simulator":
        """Return the same simulator with another limit on an episode's steps."""
        return Simulator(
            *self.functions,
            n_states=self.n_states,
            n_actions=self.n_actions,
            state_size=self.state_size,
            parameters=self.parameters,
            max_episode_steps=max_episode_steps,
            heuristic=self.heuristic,
        )

    def __repr__(self) -> str:
        return (
            f"Simulator({self.functions[1].__module__}, {self.n_states} states, {self.n_actions} actions, "
            f"max_episode_steps={self.max_episode_steps})"
        )


def check_world(world: SimulatorArrays) -> None:
    """Raise what a kernel could not: the first impossible thing that a simulator's function returned.

    Raises
    ------
    SimulatorError
        If there was one; it names state, action and step.
    """
    fault = world.fault
    if fault[KIND] == 0:
        return
    where = f"step {fault[STEP]:.0f}, action {fault[ACTION]:.0f} in state {fault[FROM_STATE]:.0f}"
    if fault[STEP] == 0:
        where = "reset"
    if fault[KIND] == OUT_OF_RANGE:
        raise SimulatorError(
            f"the simulator's index must lie from 0 to {world.n_states - 1}; after {where} it returned "
            f"{fault[TO_STATE]:.0f}: see that every state, NaN too, falls into some row"
        )
    raise SimulatorError(
        f"the simulator's reward and state must be finite; after {where} the reward is {fault[REWARD]} and the state "
        f"{world.state}"
    )
