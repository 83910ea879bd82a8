"""What learners are asked and what they show, under whatever name the version at hand has for it.

Cases use the new names. A version whose Dyna-H knows no `search_control` has the old ones.
"""

import inspect
from collections.abc import Iterable
from typing import Any

import numpy as np

import tuckerl

Arrays = dict[str, np.ndarray]

HAS_NEW_NAMES = "search_control" in inspect.signature(tuckerl.DynaH).parameters

OPTIONAL = "latest decomposition, "
"""What is in the name of an array that only one of the versions may have."""

_OLD_PARAMETERS = {"cut_traces": "cut", "search_control": "walk", "compiled": "lift"}
_OLD_VALUES: dict[str, dict[str, Any]] = {
    "compiled": {"auto": True},
    "exploration": {"independent": "members", "joint": "team"},
}
_HISTORY = ("episode", "weights", "chosen", "fit", "ranks")


def made(kind: str, env: Any, **parameters: Any) -> Any:
    """Return a new learner of the class named `kind`."""
    if not HAS_NEW_NAMES:
        parameters = dict(_with_old_name(name, value) for name, value in parameters.items())
    return getattr(tuckerl, kind)(env, **parameters)


def _with_old_name(name: str, value: Any) -> tuple[str, Any]:
    old_values = _OLD_VALUES.get(name, {})
    return _OLD_PARAMETERS.get(name, name), old_values.get(value, value) if old_values else value


def recorded(learner: Any) -> Arrays:
    """Return all that a learner has learned and remembers, as arrays."""
    arrays: Arrays = {
        "q": learner.q,
        "steps": learner.steps,
        "returns": learner.returns,
        "action weights": learner.action_weights,
        "episodes": np.array(learner.episodes),
        "tables": np.array(_first_of(learner, ("n_tables", "n_agents"))),
        "diverged at": np.array(-1 if learner.diverged_at is None else learner.diverged_at),
    }
    arrays |= {f"trajectory {agent}": states for agent, states in enumerate(learner.trajectories)}
    mask = _action_mask(learner)
    if mask is not None:
        arrays["action mask"] = mask
    return arrays | _tensor_steps(learner)


def _first_of(thing: Any, names: Iterable[str]) -> Any:
    """Return the first attribute that there is; None if there is none."""
    return next((getattr(thing, name) for name in names if hasattr(thing, name)), None)


def _action_mask(learner: Any) -> np.ndarray | None:
    """Return where an action may be taken; None where all may."""
    if hasattr(learner, "action_mask"):
        mask: np.ndarray | None = learner.action_mask
        return mask
    return None if learner.forbidden is None else ~learner.forbidden


def _tensor_steps(learner: Any) -> Arrays:
    history = _first_of(learner, ("tensor_step_history", "step_history"))
    arrays: Arrays = {f"tensor step, {name}": column for name, column in zip(_HISTORY, history, strict=True)}
    latest = _first_of(learner, ("latest_decomposition", "decomposition", "loadings"))
    if latest is None:
        return arrays
    parts = {name: getattr(latest, name) for name in ("states", "core", "episode", "fit") if hasattr(latest, name)}
    parts |= {f"factor {mode}": factor for mode, factor in enumerate(getattr(latest, "factors", ()))}
    return arrays | {f"{OPTIONAL}{name}": np.asarray(part) for name, part in parts.items()}
