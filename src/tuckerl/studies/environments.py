"""Environments by name, as commands are given them: made, told apart from others of the same name, and listed."""

import hashlib
import re
import sys
from collections.abc import Callable, Mapping
from functools import partial
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium
import pettingzoo
from gymnasium import spaces

from tuckerl.problems import ENVIRONMENTS, PARALLEL_ENVIRONMENTS
from tuckerl.problems.making import Made, make_environment


def maker(instance: int, name: str, keywords: Mapping[str, Any]) -> Callable[[], Made]:
    """Return what makes the environment: the problem of every instance, which other processes can be sent."""
    return partial(make_environment, name, keywords)


def has_several_agents(name: str) -> bool:
    """Return whether an environment that can be made is PettingZoo's."""
    return name.rpartition(":")[2] not in gymnasium.registry


def environment_specification(name: str, keywords: Mapping[str, Any]) -> dict[str, Any]:
    """Return, as JSON, all of an environment that decides results; it must have been made before."""
    plain = name.rpartition(":")[2]
    known = pettingzoo.parallel_registry if has_several_agents(name) else gymnasium.registry
    entry = known[plain].entry_point
    module = entry.split(":")[0] if isinstance(entry, str) else getattr(entry, "__module__", "")
    file = getattr(sys.modules.get(module), "__file__", None)
    sources = hashlib.sha256(Path(file).read_bytes()).hexdigest()[:16] if file else None
    versions = {library: version(library) for library in ("gymnasium", "pettingzoo")}
    return {"id": name, "keywords": dict(keywords), "sources": sources, "versions": versions}


class Listed(NamedTuple):
    """An environment and how it is played."""

    name: str
    how: str
    title: str


_LIFTED = "lifted: its table, compiled"
_COMPILED = "compiled"
_STEPPED = "stepped in Python"
_BINNED = "stepped in Python, its observations put into bins"


def listed_environments() -> list[Listed]:
    """Return this library's environments, and those of Gymnasium that need nothing else installed."""
    own = [Listed(name, _COMPILED, _title(entry)) for name, entry in ENVIRONMENTS.items()]
    teams = [
        Listed(name, f"{_COMPILED}; several agents", _title(entry)) for name, entry in PARALLEL_ENVIRONMENTS.items()
    ]
    return [*own, *teams, *(one for name in _light_ids() if (one := _of_gymnasium(name)))]


def _light_ids() -> list[str]:
    """Return the latest version of each id of Gymnasium's toy text and classic control."""
    homes = ("gymnasium.envs.toy_text.", "gymnasium.envs.classic_control.")
    latest: dict[str, gymnasium.envs.registration.EnvSpec] = {}
    for spec in gymnasium.registry.values():
        if str(spec.entry_point).startswith(homes):
            known = latest.get(spec.name)
            if known is None or (spec.version or 0) > (known.version or 0):
                latest[spec.name] = spec
    ordered = sorted(latest.values(), key=lambda spec: (not str(spec.entry_point).startswith(homes[0]), spec.name))
    return [spec.id for spec in ordered]


def _of_gymnasium(name: str) -> Listed | None:
    """Return how an environment is played, or None where its actions are continuous."""
    env = gymnasium.make(name, disable_env_checker=True)
    try:
        if isinstance(env.action_space, spaces.Box):
            return None
        how = _STEPPED
        if isinstance(env.observation_space, spaces.Box):
            how = _BINNED
        elif isinstance(getattr(env.unwrapped, "P", None), dict):
            how = _LIFTED
        return Listed(name, how, "Gymnasium")
    finally:
        env.close()


def _title(entry: Mapping[str, object]) -> str:
    """Return the first line that an environment's module says of it, without its id and source."""
    module = import_module(str(entry["entry_point"]).partition(":")[0])
    return re.split(r" as a |, | \(", (module.__doc__ or "").strip())[0]
