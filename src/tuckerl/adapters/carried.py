"""The transitions that an environment carries, and whether its own steps are those.

A table is played instead of an environment only where its ``step`` and ``reset`` are known to look everything up in
it: in this library's environments and in three of Gymnasium's toy text, as long as nobody has overridden what they do.
Whatever another class carries may be about something else, or less than what its steps do: it is stepped, unless its
user says with ``compiled=True`` that the table is the whole truth. That word is tried out first.
"""

import copy
import inspect
from collections.abc import Callable
from itertools import takewhile
from typing import Any

import numpy as np

from tuckerl.adapters.transition_tables import TOY_TEXT, extract_transition_table
from tuckerl.errors import NoTableError, ProblemError
from tuckerl.problems.mdp import TabularMDP
from tuckerl.problems.problem import Problem

_OWN = "tuckerl.environments."
# What a subclass may override and still play by its table: how it is made, shown, named and closed.
_HARMLESS = {"__init__", "action_names", "close", "metadata", "render"}
_EPISODES, _STEPS = 20, 100  # of random play, at most
_TOLERANCE = 1e-9


def carried_problem(env: Any) -> Problem | None:
    """Return the transitions that an environment carries, be they those of its steps or not; None without any.

    Raises
    ------
    ProblemError
        If it has a table ``P`` as toy text has, with mistakes.
    """
    for name in ("mdp", "simulator"):
        problem = getattr(env, name, None)
        if isinstance(problem, Problem) and problem.is_compiled:
            return problem
    return extract_transition_table(env)


def plays_what_it_carries(env: Any) -> bool:
    """Return whether an environment's steps are known to be those of the transitions that it carries."""
    kinds = type(env).__mro__
    known = next((kind for kind in kinds if kind in TOY_TEXT or kind.__module__.startswith(_OWN)), None)
    if known is None or not all(_is_untouched(known, name) for name in ("reset", "step")):
        return False
    users = takewhile(lambda kind: kind is not known, kinds)
    changed = {name for kind in users for name in vars(kind) if not _is_bookkeeping(name)}
    changed |= {name for name in getattr(env, "__dict__", {}) if callable(getattr(known, name, None))}
    return not any(hasattr(known, name) for name in changed - _HARMLESS)


def check_by_playing(problem: Problem, env: Any, source: str, make: Callable[[], Any] | None) -> None:
    """Play another environment like `env` at random, and compare its steps with the table that it carries.

    Raises
    ------
    ProblemError
        If a step is none of the table's, or the two cannot be compared.
    """
    if not isinstance(problem, TabularMDP):
        raise _unbelieved(source, "its steps cannot be compared with what it carries: pass its simulator itself as env")
    try:
        other = copy.deepcopy(env) if make is None else make()
        slip = _first_slip(problem, other)
    except ProblemError:
        raise
    except Exception as error:  # whatever an environment raises
        reason = f"it cannot be played beside its table ({type(error).__name__}: {error})"
        raise _unbelieved(source, reason) from error
    if slip is not None:
        raise _unbelieved(source, slip)


def is_outcome(mdp: TabularMDP, state: int, action: int, next_state: int, reward: float, terminated: bool) -> bool:
    """Return whether a step is among those that a table allows."""
    arrays, pair = mdp.arrays, state * mdp.n_actions + action
    which = slice(arrays.offsets[pair], arrays.offsets[pair + 1]) if arrays.offsets.size else slice(pair, pair + 1)
    found = (arrays.next_state[which] == next_state) & (arrays.terminated[which] == bool(terminated))
    return bool((found & np.isclose(arrays.reward[which], float(reward), _TOLERANCE, _TOLERANCE)).any())


def _first_slip(mdp: TabularMDP, env: Any) -> str | None:
    """Return the first thing in random play that the table does not say; None if there is none."""
    rng = np.random.default_rng(0)
    for episode in range(_EPISODES):
        state = int(env.reset(seed=episode)[0])
        if state not in mdp.arrays.start_state:
            return f"it began in state {state}, which is no first state of its table"
        for _ in range(_STEPS):
            allowed = np.arange(mdp.n_actions) if mdp.action_mask is None else np.flatnonzero(mdp.action_mask[state])
            action = int(rng.choice(allowed))
            observation, reward, terminated, truncated, _ = env.step(action)
            if not is_outcome(mdp, state, action, int(observation), reward, terminated):
                return (
                    f"action {action} in state {state} led to {observation} with reward {reward} and terminated "
                    f"{bool(terminated)}, which its table does not hold"
                )
            if terminated or truncated:
                break
            state = int(observation)
    return None


def _is_untouched(kind: type, name: str) -> bool:
    """Return whether a method is the one that its class's own module wrote."""
    method = inspect.getattr_static(kind, name)
    home = next(owner for owner in kind.__mro__ if name in vars(owner)).__module__
    return bool(getattr(method, "__globals__", {}).get("__name__") == home)


def _is_bookkeeping(name: str) -> bool:
    """Return whether Python itself put a name into a class."""
    return name.startswith("__") and name not in {"__init__", "__getattr__", "__getattribute__", "__setattr__"}


def _unbelieved(source: str, reason: str) -> ProblemError:
    return NoTableError(
        f"compiled=True plays {source} from the table that it carries, and {reason}",
        ": correct one of them, or leave compiled at 'auto', which steps it in Python",
    )
