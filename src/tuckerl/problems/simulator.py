"""Problems that are compiled functions instead of tables: a few numbers that move, and the table's row they fall into.

Two functions of fixed signatures describe one::

    reset(parameters, state, rng)                                 put the first state into `state`, every entry of it
    step(parameters, state, action, rng) -> (reward, terminated)  move `state` in place

and, unless the first entry of the state is the row of the Q-table, a third says which row it falls into::

    index(parameters, state) -> int                               from 0 to n_states - 1

`parameters` (not to be written to) and `state` are float64 arrays, `rng` is a (4,) uint64 stream for
:func:`tuckerl.rng.uniform`. The functions are compiled: they use numbers, arrays and ``math``, and the values that
other names have when a simulator's first learner is made; what is to be changed later belongs into `parameters`. All
simulators share the learners' compiled kernels, because kernels know the signatures and not the functions.
"""

import copy
import inspect
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tuckerl._jit import compiled_function
from tuckerl.checks import check_int
from tuckerl.errors import ParameterTypeError, ProblemError, SimulatorError
from tuckerl.problems.mdp import NO_LIMIT, Layout, check_heuristic, check_layout
from tuckerl.problems.worlds import World
from tuckerl.types import FloatArray, Stream

Reset = Callable[[FloatArray, FloatArray, Stream], None]
Step = Callable[[FloatArray, FloatArray, int, Stream], tuple[float, bool]]
Index = Callable[[FloatArray, FloatArray], int]

# What `fault` holds once a function has returned something impossible; the state array as it was then follows.
KIND, FROM_STATE, ACTION, STEP, TO_STATE, REWARD, NUMBERS = range(7)
OUT_OF_RANGE, NOT_FINITE = 1.0, 2.0


_ARGUMENTS = {
    "reset": "(parameters, state, rng)",
    "step": "(parameters, state, action, rng)",
    "index": "(parameters, state)",
}


def first_entry(parameters: FloatArray, state: FloatArray) -> int:
    """Return the row of a state whose first entry is its row."""
    return int(state[0])


@dataclass(frozen=True)
class Functions:
    """A simulator's three functions: plain Python, as its user wrote them."""

    reset: Reset
    step: Step
    index: Index


class SimulatorArrays(NamedTuple):
    """What kernels read of a simulator."""

    reset: Any  # compiled
    step: Any
    index: Any
    parameters: FloatArray  # read-only
    state: FloatArray  # changed in place: one for each agent
    fault: FloatArray  # (6 + size of state,) the first impossible thing that happened; all 0 while there is none
    clock: FloatArray  # (1,) steps since the latest reset
    n_states: int
    n_actions: int
    max_episode_steps: int  # NO_LIMIT where there is none


class Simulator:
    """A problem given by compiled functions.

    Parameters
    ----------
    reset, step : functions
        As the module's documentation says.
    index : function, optional
        Default: the first entry of the state is the row.
    n_states, n_actions : int
        Rows and columns of the Q-table.
    state_size : int
        Length of the state array.
    parameters : (P,) float, optional
        Numbers that the functions read.
    max_episode_steps : int, optional
        An episode is truncated after as many steps; default: never.
    heuristic : (n_states,) float, optional
        What ``DynaH`` uses by default.
    layout : (rows, columns), optional
        Where the states are the cells of a grid, row by row: how pictures show them.

    Attributes
    ----------
    functions : Functions
        As they were given: to be called from Python, too.

    Raises
    ------
    ParameterError, ParameterTypeError, ProblemError
        If a number is impossible, or a function is none or takes other arguments.

    Examples
    --------
    A walk on a line of 5 places that ends at the right:

    >>> import tuckerl
    >>> from tuckerl.problems.simulator import Simulator
    >>> from tuckerl.rng import uniform
    >>> def reset(parameters, state, rng):
    ...     state[0] = 0.0
    >>> def step(parameters, state, action, rng):
    ...     if uniform(rng) >= parameters[0]:
    ...         state[0] = min(max(state[0] + (1.0 if action == 1 else -1.0), 0.0), 4.0)
    ...     return -1.0, state[0] == 4.0
    >>> line = Simulator(reset, step, n_states=5, n_actions=2, parameters=[0.1], max_episode_steps=1000)
    """

    def __init__(
        self,
        reset: Reset,
        step: Step,
        index: Index | None = None,
        *,
        n_states: int,
        n_actions: int,
        state_size: int = 1,
        parameters: ArrayLike = (),
        max_episode_steps: int | None = None,
        heuristic: ArrayLike | None = None,
        layout: Layout | None = None,
    ) -> None:
        self.functions = Functions(reset, step, first_entry if index is None else index)
        _check_functions(self.functions)
        self.n_states = check_int("n_states", n_states, 1)
        self.n_actions = check_int("n_actions", n_actions, 1)
        self.state_size = check_int("state_size", state_size, 1)
        self.parameters = _check_parameters(parameters)
        self.max_episode_steps = _check_limit(max_episode_steps)
        self.heuristic = None if heuristic is None else check_heuristic(heuristic, self.n_states)
        self.layout = check_layout(layout, self.n_states)

    shares_world = False
    is_capped = False  # whether the time limit is ours, as there was none
    source: str | None = None
    """What the environment is called that carried it; None where there was none."""

    @cached_property
    def _compiled(self) -> tuple[Any, ...]:
        return tuple(compiled_function(getattr(self.functions, role), role) for role in _ARGUMENTS)

    def world(self) -> World:
        """Return one agent's own copy.

        Raises
        ------
        SimulatorError
            If a function cannot be compiled, or returns something of another kind than it should.
        """
        reset, step, index = self._compiled
        arrays = SimulatorArrays(
            reset=reset,
            step=step,
            index=index,
            parameters=self.parameters,
            state=np.zeros(self.state_size),
            fault=np.zeros(NUMBERS + self.state_size),
            clock=np.zeros(1),
            n_states=self.n_states,
            n_actions=self.n_actions,
            max_episode_steps=self.max_episode_steps or NO_LIMIT,
        )
        return SimulatorWorld(arrays)

    def with_time_limit(self, max_episode_steps: int | None) -> "Simulator":
        """Return the same simulator with another limit on an episode's steps."""
        other = copy.copy(self)
        other.max_episode_steps = _check_limit(max_episode_steps)
        if "_compiled" in vars(self):  # what is compiled knows no limit, and took longer than most of what follows
            vars(other)["_compiled"] = self._compiled
        return other

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name != "_compiled"}

    def __repr__(self) -> str:
        return (
            f"Simulator({self.functions.step.__module__}, {self.n_states} states, {self.n_actions} actions, "
            f"max_episode_steps={self.max_episode_steps})"
        )


def _check_functions(functions: Functions) -> None:
    for role, arguments in _ARGUMENTS.items():
        function = getattr(functions, role)
        python = getattr(function, "py_func", function)  # a function compiled by its user is taken apart again
        if not inspect.isfunction(python):
            raise ParameterTypeError(f"{role} must be a function {role}{arguments}; got {function!r}")
        try:
            inspect.signature(python).bind(*arguments.split(","))
        except TypeError as error:
            raise ProblemError(
                f"{role} must take the arguments {arguments}; got {python.__name__}{inspect.signature(python)}"
            ) from error


def _check_parameters(parameters: ArrayLike) -> FloatArray:
    try:
        numbers: FloatArray = np.array(parameters, dtype=np.float64).reshape(-1)
    except (TypeError, ValueError) as error:
        raise ProblemError(f"parameters must be numbers; got {parameters!r}") from error
    if not np.isfinite(numbers).all():
        raise ProblemError(f"parameters must be finite numbers; got {numbers}")
    numbers.flags.writeable = False
    return numbers


def _check_limit(max_episode_steps: int | None) -> int | None:
    if max_episode_steps is None:
        return None
    return min(check_int("max_episode_steps", max_episode_steps, 1), NO_LIMIT)


class SimulatorWorld(World):
    """One agent's copy of a simulator."""

    def raise_pending(self) -> None:
        """Raise the first impossible thing that a function returned, and forget it.

        Raises
        ------
        SimulatorError
            If there was one; it names state, action and step.
        """
        fault = self.arrays.fault
        if fault[KIND] == 0:
            return
        error = _fault_error(fault.copy(), self.arrays.n_states)
        fault[:] = 0.0
        raise error


def _fault_error(fault: FloatArray, n_states: int) -> SimulatorError:
    where = f"step {fault[STEP]:.0f} of an episode (action {fault[ACTION]:.0f} in state {fault[FROM_STATE]:.0f})"
    if fault[STEP] == 0:
        where = "reset"
    numbers = f"the state array was {fault[NUMBERS:]}"
    if fault[KIND] == OUT_OF_RANGE:
        return SimulatorError(
            f"the simulator's index must lie from 0 to {n_states - 1}; after {where} it was "
            f"{fault[TO_STATE]:.0f} (or index raised an error, which reads as -1); {numbers}"
        )
    return SimulatorError(
        f"the simulator's rewards and states must be finite; after {where} the reward was {fault[REWARD]} and "
        f"{numbers} (a function that raises an error leaves NaN: call it from Python to see the error)"
    )
