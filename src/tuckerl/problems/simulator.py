"""Problems given by compiled functions that move a few numbers, from which the table's row follows.

Two functions of fixed signatures describe a problem::

    reset(parameters, state, rng)                                 put the first state into `state`, every entry of it
    step(parameters, state, action, rng) -> (reward, terminated)  move `state` in place

and, unless the first entry of the state is the row of the Q-table, a third gives the row::

    index(parameters, state) -> int                               from 0 to n_states - 1

`parameters` (not to be written to) and `state` are float64 arrays, `rng` is a (4,) uint64 stream for
:func:`tuckerl.rng.uniform`. The functions are compiled: they use numbers, arrays and ``math``. Other names keep
the values that they have when a simulator's first learner is made, so put what changes later into `parameters`. All
simulators share the learners' compiled kernels, as kernels depend on the signatures, not on the functions.
"""

import inspect
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tuckerl._jit import compiled_function, is_ours, kernel
from tuckerl.checks import check_int, shown
from tuckerl.errors import ParameterTypeError, ProblemError, SavedFileError, SimulatorError
from tuckerl.problems.dynamics import register_dynamics
from tuckerl.problems.parts import NO_LIMIT, Layout, StoredSimulator, check_parameters
from tuckerl.problems.problem import GIVE_ENV, Arrays, Header, Problem
from tuckerl.problems.worlds import World
from tuckerl.saved_arrays import SavedArrays
from tuckerl.saved_json import checked_json
from tuckerl.spaces.description import Description, describe_numbers
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
    """Return the first entry of the state: the default index."""
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


@kernel
def _reset(world: SimulatorArrays, rng: Stream) -> int:
    """Return the first state of an episode.

    Parameters
    ----------
    world : SimulatorArrays
        Its state, clock and perhaps fault are changed.
    rng : (4,) uint64
        The agent's stream, as far as the simulator draws.
    """
    world.clock[0] = 0.0
    world.reset(world.parameters, world.state, rng)
    return max(_index(world, 0, 0, 0.0), 0)


@kernel
def _step(world: SimulatorArrays, state: int, action: int, rng: Stream) -> tuple[int, float, bool]:
    """Return the next state, the reward, and whether the return ends there.

    Parameters
    ----------
    world : SimulatorArrays
        Its state, clock and perhaps fault are changed.
    state, action : int
    rng : (4,) uint64
        The agent's stream, as far as the simulator draws.
    """
    world.clock[0] += 1.0
    # An unsigned action would wrap around in "action - 1" where nothing is compiled; its signature says int64.
    reward, terminated = world.step(world.parameters, world.state, int(action), rng)
    next_state = _index(world, state, action, reward)
    if next_state < 0 or world.fault[KIND] > 0.0:  # end every episode at once: there may be no time limit
        return 0, 0.0, True
    return next_state, reward, terminated


@kernel
def _must_return(world: SimulatorArrays) -> bool:
    """Return whether a function has returned something impossible."""
    return world.fault[KIND] > 0.0


@kernel
def _index(world: SimulatorArrays, state: int, action: int, reward: float) -> int:
    """Return the state's row, or -1 where a number is not finite or the row is out of range."""
    if not _is_finite(world, reward):
        _note_fault(world, NOT_FINITE, state, action, reward, -1)
        return -1
    index = world.index(world.parameters, world.state)
    if 0 <= index < world.n_states:
        return index
    _note_fault(world, OUT_OF_RANGE, state, action, reward, index)
    return -1


@kernel
def _is_finite(world: SimulatorArrays, reward: float) -> bool:
    """Return whether the reward and all of the state are finite."""
    total = reward - reward  # 0 for a finite number, NaN for any other
    for number in world.state:
        total += number - number
    return total == 0.0


@kernel
def _note_fault(world: SimulatorArrays, kind: float, state: int, action: int, reward: float, index: int) -> None:
    """Keep the first impossible thing for Python to raise."""
    fault = world.fault
    if fault[KIND] == 0.0:
        fault[KIND], fault[FROM_STATE], fault[ACTION], fault[STEP] = kind, state, action, world.clock[0]
        fault[TO_STATE], fault[REWARD] = index, reward
        for i in range(world.state.size):
            fault[NUMBERS + i] = world.state[i]


register_dynamics(SimulatorArrays, reset=_reset, step=_step, must_return=_must_return)


class Simulator(Problem):
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
    heuristic, layout, action_names, state_factors
        See :class:`~tuckerl.problems.problem.Problem`.

    Attributes
    ----------
    functions : Functions
        As they were given; Python can call them, too.

    Raises
    ------
    ParameterError, ParameterTypeError, ProblemError
        If a number is impossible, or what was given is no function or takes other arguments.

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

    kind = "simulator"
    title = "simulator"
    how_played = "compiled simulator"

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
        action_names: Sequence[str] | None = None,
        state_factors: Sequence[tuple[str, int]] | None = None,
    ) -> None:
        self.functions = Functions(reset, step, first_entry if index is None else index)
        _check_functions(self.functions)
        super().__init__(
            n_states,
            n_actions,
            max_episode_steps=max_episode_steps,
            heuristic=heuristic,
            layout=layout,
            action_names=action_names,
            state_factors=state_factors,
        )
        self.state_size = check_int("state_size", state_size, 1)
        self.parameters = check_parameters(parameters)

    @property
    def world_bytes(self) -> int:
        """Bytes of a world's numbers, and of those that tell what went wrong."""
        return 8 * (NUMBERS + 2 * self.state_size)

    @cached_property
    def _compiled(self) -> tuple[Any, Any, Any]:
        reset, step, index = (compiled_function(getattr(self.functions, role), role) for role in _ARGUMENTS)
        return reset, step, index

    def world(self) -> World:
        """Return one agent's own copy.

        Raises
        ------
        SimulatorError
            If a function cannot be compiled, or returns something of another kind than it should.
        """
        arrays = SimulatorArrays(
            *self._compiled,
            parameters=self.parameters,
            state=np.zeros(self.state_size),
            fault=np.zeros(NUMBERS + self.state_size),
            clock=np.zeros(1),
            n_states=self.n_states,
            n_actions=self.n_actions,
            max_episode_steps=self.max_episode_steps or NO_LIMIT,
        )
        world = SimulatorWorld(arrays)
        world.has_users_functions = not all(map(is_ours, vars(self.functions).values()))
        return world

    def save(self) -> tuple[Header, Arrays]:
        """Return the simulator's sizes and parameters: no file holds its functions."""
        return {"simulator": self.sizes, "source": self.source, "description": self.description()}, {}

    def description(self) -> Description:
        """Return all that makes this simulator the one that it is, but for its functions, as JSON."""
        parameters = {"state size": self.state_size, "parameters": describe_numbers(self.parameters)}
        return super().description() | parameters

    @classmethod
    def restore(
        cls, header: Header, arrays: SavedArrays, given: Any, resolve: Callable[..., Problem], path: Path
    ) -> Problem:
        """Return the simulator that the user gave, which must have the saved one's sizes and parameters."""
        checked_json(header, StoredSimulator, f"the simulator in {path}")
        if given is None:
            raise SavedFileError(f"{path} was learned on a simulator, whose functions no file holds: {GIVE_ENV}")
        problem = resolve(given)
        cls._check_same(problem, header, header["simulator"], path, "a simulator")
        return problem

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name != "_compiled"}

    def __repr__(self) -> str:
        return (
            f"Simulator({self.functions.step.__module__}, {shown(self.n_states)} states, "
            f"{shown(self.n_actions)} actions, max_episode_steps={self.max_episode_steps})"
        )


def _check_functions(functions: Functions) -> None:
    for role, arguments in _ARGUMENTS.items():
        function = getattr(functions, role)
        python = getattr(function, "py_func", function)  # its user may have compiled it
        if not inspect.isfunction(python):
            raise ParameterTypeError(f"{role} must be a function {role}{arguments}; got {shown(function)}")
        try:
            inspect.signature(python).bind(*arguments.split(","))
        except TypeError as error:
            raise ProblemError(
                f"{role} must take the arguments {arguments}; got {python.__name__}{inspect.signature(python)}"
            ) from error


class SimulatorWorld(World):
    """One agent's copy of a simulator."""

    def keep(self) -> None:
        """Remember the simulator's state."""
        self._kept = self.arrays.state.copy()

    def undo(self) -> None:
        """Bring the simulator's state back, in arrays that a function which has not returned does not know."""
        self.arrays = self.arrays._replace(
            state=self._kept.copy(), fault=np.zeros_like(self.arrays.fault), clock=np.zeros(1)
        )

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
