"""Checks of simulators: their functions in plain Python, then compiled, on the same states, actions and streams."""

import math
from collections.abc import Iterator
from numbers import Integral, Real
from typing import Any, NamedTuple

import numpy as np

from tuckerl.checks import shown
from tuckerl.errors import ProblemCheckError, SimulatorError
from tuckerl.problems.dynamics import reset, step
from tuckerl.problems.simulator import KIND, Simulator, first_entry
from tuckerl.rng import child, seed_sequence, stream
from tuckerl.testing.limits import BUDGET, LONGEST
from tuckerl.types import FloatArray, Stream

TOLERANCE = 1e-9
"""Relative, between what Python and compiled code compute in one step."""

_GARBAGE = (1234.5, -7.25)  # what stands in the state before two resets that must come out alike
_STREAM_ONLY = "use nothing but the arguments: draw with tuckerl.rng.uniform(rng), keep what is remembered in `state`"


class Where(NamedTuple):
    """A call in words, once they are needed: to write an array down takes longer than the call."""

    episode: int
    step: int = 0
    action: int = -1
    state: FloatArray | None = None

    def __str__(self) -> str:
        if self.step == 0:
            return f"in the reset of episode {self.episode}"
        return f"in step {self.step} of episode {self.episode} (action {self.action} in state {self.state})"


class Moment(NamedTuple):
    """One call of reset (action -1) or step, as Python made it."""

    where: Where
    before: FloatArray
    words_before: Stream
    action: int
    after: FloatArray
    words_after: Stream
    reward: float
    terminated: bool
    row: int


def check_simulator(simulator: Simulator, episodes: int, seed: int) -> None:
    """Check a simulator's functions on random play.

    Raises
    ------
    ProblemCheckError
    """
    interpreted = _Interpreted(simulator)
    moments = list(_played(interpreted, episodes, seed))
    try:
        world = simulator.world()
    except SimulatorError as error:
        raise ProblemCheckError(f"{error}") from error
    for moment in moments:
        _compare(simulator, world, moment)


def _played(functions: "_Interpreted", episodes: int, seed: int) -> Iterator[Moment]:
    sequence, n_steps = seed_sequence(seed), 0
    limit = functions.simulator.max_episode_steps
    for episode in range(episodes):
        words, choose = stream(child(sequence, episode, 0)), np.random.default_rng(child(sequence, episode, 1))
        moment = functions.begun(words, Where(episode))
        yield moment
        n_done = 0
        while not moment.terminated and n_done < min(limit or LONGEST, LONGEST):
            action, n_done = int(choose.integers(functions.simulator.n_actions)), n_done + 1
            moment = functions.stepped(moment, action, Where(episode, n_done, action, moment.after))
            yield moment
        if (limit is None or functions.simulator.is_capped) and not moment.terminated:
            raise ProblemCheckError(
                f"an episode of {functions.simulator} did not end in {LONGEST:,} steps of random play, and there is no "
                "time limit: set max_episode_steps, or let step return True where an episode ends"
            )
        n_steps += n_done
        if n_steps >= BUDGET:
            return


class _Interpreted:
    """A simulator's functions as its user wrote them, called with care."""

    def __init__(self, simulator: Simulator) -> None:
        self.simulator = simulator

    def begun(self, words: Stream, where: Where) -> Moment:
        """Reset twice, over two different states."""
        garbage = [np.full(self.simulator.state_size, number) for number in _GARBAGE]
        (first, own, returned), (second, other, _) = (self._moved("reset", where, state, words) for state in garbage)
        if returned is not None:
            raise ProblemCheckError(
                f"reset must return nothing and write the first state into `state`; it returned {shown(returned)}"
            )
        kept = np.flatnonzero((first == garbage[0]) & (second == garbage[1]))
        if kept.size:
            raise ProblemCheckError(
                f"reset must set every entry of the state, which still holds the former episode's; {where} entry "
                f"{kept[0]} was left as it was: begin with `state[:] = 0.0`"
            )
        if not _same(first, second) or not _same(own, other):
            raise ProblemCheckError(
                f"reset must give the same state on the same stream; {where} it gave {first}, then {second}: "
                f"{_STREAM_ONLY}"
            )
        return Moment(where, garbage[0], words, -1, first, own, 0.0, False, self._row(first, 0.0, where))

    def stepped(self, last: Moment, action: int, where: Where) -> Moment:
        """Step twice, from the same state on the same stream."""
        results = [self._moved("step", where, last.after, last.words_after, action) for _ in range(2)]
        for _, _, returned in results:
            if not isinstance(returned, tuple) or len(returned) != 2 or not _is_outcome(*returned):
                raise ProblemCheckError(
                    f"step must return (reward, terminated), a number and a bool; {where} it returned "
                    f"{shown(returned)}: write, for example, `return -1.0, state[0] == 4.0`"
                )
        first, second = ((state, own, float(paid), bool(ended)) for state, own, (paid, ended) in results)
        if not all(map(_same, first, second)):
            raise ProblemCheckError(
                f"step must give the same on the same state, action and stream; {where} it gave state {first[0]}, "
                f"reward {first[2]}, terminated {first[3]}, then {second[0]}, {second[2]}, {second[3]}: {_STREAM_ONLY}"
            )
        return Moment(where, last.after, last.words_after, action, *first, self._row(first[0], first[2], where))

    def _row(self, state: FloatArray, reward: float, where: Where) -> int:
        """Return the row of a state, which must be finite as the reward."""
        if not np.isfinite(state).all() or not math.isfinite(reward):
            raise ProblemCheckError(
                f"rewards and states must be finite; {where} the reward was {reward} and the state {state}: end "
                "the episode before, or keep the numbers within bounds"
            )
        seen = state.copy()
        row = self._call("index", where, seen)
        if not _same(seen, state):
            raise ProblemCheckError(
                f"index must only look at the state; {where} it changed it from {state} to {seen}: move that into step"
            )
        n_states = self.simulator.n_states
        if self.simulator.functions.index is first_entry and state[0] != row:
            raise ProblemCheckError(
                f"without an index function the first entry of the state is the row of the table; {where} it was "
                f"{state[0]}, no whole number: pass index(parameters, state), which returns the row"
            )
        if isinstance(row, bool) or not isinstance(row, Integral):
            raise ProblemCheckError(
                f"index must return an int; {where} it returned {shown(row)}: write int(...) around it"
            )
        if not 0 <= int(row) < n_states:
            raise ProblemCheckError(
                f"index must lie from 0 to {n_states - 1}; {where} it was {int(row)}, the state being {state}: make "
                "n_states larger, or clip: min(max(..., 0), n - 1)"
            )
        return int(row)

    def _moved(
        self, role: str, where: Where, before: FloatArray, words: Stream, *action: int
    ) -> tuple[FloatArray, Stream, Any]:
        """Return the state and the stream that reset or step leave, and what they return."""
        state, own = before.copy(), words.copy()
        returned = self._call(role, where, state, *action, own)
        return state, own, returned

    def _call(self, role: str, where: Where, *arguments: Any) -> Any:
        function = getattr(self.simulator.functions, role)
        parameters = np.array(self.simulator.parameters)  # a copy that may be written to, to say who did
        try:
            returned = getattr(function, "py_func", function)(parameters, *arguments)
        except Exception as error:  # whatever a user's function raises
            raise ProblemCheckError(
                f"{role} raised {type(error).__name__} {where}: {error}; correct it, as compiled code cannot raise"
            ) from error
        if not _same(parameters, self.simulator.parameters):
            raise ProblemCheckError(
                f"{role} must not write to `parameters`, which all agents share; {where} it made "
                f"{self.simulator.parameters} into {parameters}: keep what changes in `state`"
            )
        return returned


def _compare(simulator: Simulator, world: Any, moment: Moment) -> None:
    """Check that compiled code does in one call what Python did."""
    arrays, words = world.arrays, moment.words_before.copy()
    arrays.state[:], arrays.fault[:] = moment.before, 0.0
    reward, terminated = 0.0, False
    if moment.action < 0:
        row = reset(arrays, words)
    else:
        row, reward, terminated = step(arrays, 0, moment.action, words)
    state, exact = arrays.state.copy(), _same(arrays.state, moment.after)
    fault = "a state or a number that is impossible, or an error"
    close, alike = np.allclose(state, moment.after, TOLERANCE, TOLERANCE), terminated == moment.terminated
    # Where the states differ by rounding, what jumps at an edge may differ with them.
    expected = simulator.functions.index(simulator.parameters, state) if close and not exact else moment.row
    for agrees, what, python, compiled in (
        (arrays.fault[KIND] == 0.0, "result", f"that of {moment.after}", fault),
        (_same(words, moment.words_after), "stream", moment.words_after, words),
        (close, "state", moment.after, state),
        (row == expected, "index", expected, row),
        (alike or not exact, "terminated", moment.terminated, terminated),
        (not alike or np.isclose(reward, moment.reward, TOLERANCE, TOLERANCE), "reward", moment.reward, reward),
    ):
        if not agrees:
            raise ProblemCheckError(
                f"Python and compiled code must agree to {TOLERANCE:g}; {moment.where} the {what} is {python} in "
                f"Python and {compiled} compiled: names outside of the functions keep the value that they had when "
                "these were compiled (put what changes into `parameters`), random and np.random have other streams "
                "(use tuckerl.rng.uniform), and whole numbers have 64 bits"
            )


def _is_outcome(reward: Any, terminated: Any) -> bool:
    is_number = isinstance(reward, Real) and not isinstance(reward, bool)
    return is_number and isinstance(terminated, (bool, np.bool_))


def _same(first: Any, second: Any) -> bool:
    return np.array_equal(first, second, equal_nan=True)
