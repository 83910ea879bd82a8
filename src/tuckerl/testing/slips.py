"""A check of kernels in plain Python, in a process of its own: which of them reaches outside of which array.

Compiled kernels of users' own check the bounds of what they read and write themselves, and not those of the library's
kernels that they call. Here all are interpreted, on arrays that know their names.
"""

import multiprocessing
import sys
import traceback
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from tuckerl.errors import LearnerCheckError
from tuckerl.testing.interpreting import interpreted
from tuckerl.testing.small_problems import masked, slippery
from tuckerl.testing.subject import EVERY, Subject
from tuckerl.training.kernel_calls import KernelCall
from tuckerl.training.loop import play

_PATIENCE = 300.0  # seconds, of which one or two are usual
_NEVER = f"its kernels did not come back within {_PATIENCE:.0f} seconds of plain Python: does a loop in them never end?"
_UNLIMITED = sys.maxsize
_PACKAGE = str(Path(__file__).parents[1])


def check_slips(subject: Subject) -> None:
    """Check that no kernel reaches outside of an array, ends the interpreter or never comes back.

    Raises
    ------
    LearnerCheckError
        It names the array, the index, the shape, the kernel and its line.
    """
    slip = _told_by_a_process(subject) if "fork" in multiprocessing.get_all_start_methods() else _first_slip(subject)
    if slip:
        raise LearnerCheckError(f"kernels must stay within their arrays; of {subject.name}, {slip}")


def _told_by_a_process(subject: Subject) -> str:
    """Look for a slip in a process that may die. It is forked, as a class need not be one that others can import."""
    context = multiprocessing.get_context("fork")
    receiving, sending = context.Pipe(duplex=False)
    process = context.Process(target=lambda: sending.send(_first_slip(subject)), daemon=True)
    process.start()
    sending.close()
    try:
        return str(receiving.recv()) if receiving.poll(_PATIENCE) else _NEVER
    except EOFError:
        process.join()
        return f"its kernels ended the interpreter (exit status {process.exitcode})"
    finally:
        process.kill()
        process.join()


def _first_slip(subject: Subject) -> str:
    """Return the first access outside of an array in words, nothing if there is none."""
    slips: list[str] = []
    for problem in (slippery(), masked()):
        state = (learner := subject.on(problem, n_agents=2, tensor_step=subject.tensor_step()))._state
        call = KernelCall(calls_python=True)
        play_interpreted: Any = interpreted(play)  # now that all kernels are registered
        for number, world in enumerate(state.worlds):
            agent = state.agent(number, EVERY, _UNLIMITED, world.action_masks[0], learner.algorithm_state, call)
            with suppress(Exception):  # other mistakes are for the other checks to find, in compiled code
                play_interpreted(world.arrays, _watched(agent, "agent", slips))
            if slips:
                return slips[0]
    return ""


class _WatchedArray(np.ndarray):
    """An array that knows its name, and writes down where somebody reaches outside of it."""

    name: str
    slips: list[str]

    def __array_finalize__(self, source: Any) -> None:
        self.name, self.slips = getattr(source, "name", ""), getattr(source, "slips", [])

    def __getitem__(self, index: Any) -> Any:
        try:
            return super().__getitem__(index)
        except IndexError:
            self._note(index)
            raise

    def __setitem__(self, index: Any, value: Any) -> None:
        try:
            super().__setitem__(index, value)
        except IndexError:
            self._note(index)
            raise

    def _note(self, index: Any) -> None:
        stack = traceback.extract_stack()[:-2]
        inner = stack[max(i for i, place in enumerate(stack) if place.name == "_first_slip") :]
        users = next((place for place in reversed(inner) if not place.filename.startswith(_PACKAGE)), stack[-1])
        numbers = ", ".join(map(str, index if isinstance(index, tuple) else (index,)))
        text = f"{_told(stack[-1])} reached for {self.name}[{numbers}], whose shape is {self.shape}"
        is_passed_on = users is not stack[-1]  # by a kernel of the user's to one of ours
        self.slips.append(f"{text}, as {_told(users)} asked it to" if is_passed_on else text)


def _told(place: traceback.FrameSummary) -> str:
    return f"{place.name} (line {place.lineno} of {Path(place.filename).name})"


def _watched(value: Any, name: str, slips: list[str]) -> Any:
    """Return what kernels read with its arrays watched: an array, a NamedTuple of such, or anything else as it is."""
    if isinstance(value, np.ndarray):
        array = value.view(_WatchedArray)
        array.name, array.slips = name, slips
        return array
    if isinstance(value, tuple):
        parts = [_watched(part, f"{name}.{field}", slips) for field, part in zip(_fields(value), value, strict=True)]
        return type(value)(*parts) if hasattr(value, "_fields") else tuple(parts)
    return value


def _fields(value: tuple[Any, ...]) -> tuple[str, ...]:
    return getattr(value, "_fields", tuple(map(str, range(len(value)))))
