"""Environments by name, as commands are given them: made, identified, and listed."""

import hashlib
import re
import shlex
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium
import pettingzoo
from gymnasium import spaces

from tuckerl.adapters.making import Made, make_environment
from tuckerl.adapters.python_problem import PythonProblem
from tuckerl.adapters.resolve import AdapterOptions, Agents, Environment, as_problem
from tuckerl.environments import ENVIRONMENTS, PARALLEL_ENVIRONMENTS
from tuckerl.errors import ProblemError, SpaceError


def maker(instance: int, name: str, keywords: Mapping[str, Any], varied: str = "") -> Callable[[], Made]:
    """Return what makes the environment of an instance, which other processes can be sent.

    All instances are the same but for the keyword `varied`, which has the instance's number where it is given.
    """
    return partial(make_environment, name, {**keywords, varied: instance} if varied else keywords)


def environment_of(name: str, keywords: Mapping[str, Any]) -> Environment:
    """Return an id, from which files can make the environment again; with keywords, what makes it."""
    return maker(0, name, dict(keywords)) if keywords else name


BINS_THAT_LEARN = dict.fromkeys(
    ("CartPole-v0", "CartPole-v1"), "[[],[],[-0.12,-0.07,-0.04,0,0.04,0.07,0.12],[-0.8,-0.4,0,0.4,0.8]]"
)
"""Bins with which Q-learning as it is by default learns to balance within a thousand episodes; by environment."""

_BINS = (
    "in a command, --set bins={bins}, or a number or edges for each dimension, such as --set bins='[20,[-1,0,1]]', "
    "and in train also --quantile-bins 20"
)


@contextmanager
def bins_named(environment: str, how: str = _BINS) -> Iterator[None]:
    """Say how the bins that an environment lacks are given, with some that learn where these are known.

    Parameters
    ----------
    environment : str
        Its id.
    how : str
        What a user writes, in words that have ``{bins}`` in the place of the bins. Default: as commands take them.

    Raises
    ------
    SpaceError
        As the block does, with that added where it is about bins.
    """
    try:
        yield
    except SpaceError as error:
        if "bins" not in str(error):
            raise
        known = BINS_THAT_LEARN.get(environment)
        none_given = "give bins" in str(error)
        short = f"{environment} observes numbers, which tables need in bins"
        reason = short if known and none_given else str(error)
        written = shlex.quote(known or "20") if how == _BINS else known or "20"
        raise SpaceError(f"{reason}; {how.replace('{bins}', written)}") from error


def has_several_agents(name: str) -> bool:
    """Return whether an environment that can be made is PettingZoo's."""
    return name.rpartition(":")[2] not in gymnasium.registry


def environment_module(name: str) -> str:
    """Return the module in which an environment is written, "" if nothing says it; it must have been made before."""
    plain = name.rpartition(":")[2]
    known = pettingzoo.parallel_registry if has_several_agents(name) else gymnasium.registry
    entry = known[plain].entry_point
    return entry.split(":")[0] if isinstance(entry, str) else str(getattr(entry, "__module__", ""))


def environment_specification(name: str, keywords: Mapping[str, Any]) -> dict[str, Any]:
    """Return, as JSON, an environment and the digest of its module's file; it must have been made before."""
    file = getattr(sys.modules.get(environment_module(name)), "__file__", None)
    sources = hashlib.sha256(Path(file).read_bytes()).hexdigest()[:16] if file else None
    return {"id": name, "keywords": dict(keywords), "sources": sources}


class ListedEnvironment(NamedTuple):
    """How an environment is played, and what it is."""

    how: str
    title: str


_BINNED = f"{PythonProblem.how_played}, its observations put into bins"
_TEAM = "{}, for a team (team-q, team-tq); {}, where each agent learns by itself"


def listed_environments() -> dict[str, ListedEnvironment]:
    """Return this library's environments, and those of Gymnasium that can be played with what is installed."""
    own = {name: ListedEnvironment(as_problem(name).how_played, _title(entry)) for name, entry in ENVIRONMENTS.items()}
    teams = {name: ListedEnvironment(_how_teams(name), _title(entry)) for name, entry in PARALLEL_ENVIRONMENTS.items()}
    return own | teams | {name: ListedEnvironment(how, "Gymnasium") for name in _light_ids() if (how := _how(name))}


def _how_teams(name: str) -> str:
    together, apart = (
        as_problem(name, AdapterOptions(agents)).how_played for agents in (Agents.JOINT, Agents.INDEPENDENT)
    )
    return _TEAM.format(together, apart)


def _light_ids() -> list[str]:
    """Return the latest version of each id of Gymnasium's toy text and classic control."""
    homes = ("gymnasium.envs.toy_text.", "gymnasium.envs.classic_control.")
    light = [spec for spec in gymnasium.registry.values() if str(spec.entry_point).startswith(homes)]
    latest = {spec.name: spec for spec in sorted(light, key=lambda spec: spec.version or 0)}
    ordered = sorted(latest.values(), key=lambda spec: (not str(spec.entry_point).startswith(homes[0]), spec.name))
    return [spec.id for spec in ordered]


def _how(name: str) -> str:
    """Return how an environment is played; "" where it cannot be made, or has continuous actions."""
    try:
        env: Any = make_environment(name)
    except ProblemError:  # it needs what is not installed
        return ""
    env.close()
    if isinstance(env.action_space, spaces.Box):
        return ""
    return _BINNED if isinstance(env.observation_space, spaces.Box) else as_problem(name).how_played


def _title(entry: Mapping[str, object]) -> str:
    """Return the first line that an environment's module says of it, without its id and source."""
    module = import_module(str(entry["entry_point"]).partition(":")[0])
    return re.split(r" as a |, | \(", (module.__doc__ or "").strip())[0]
