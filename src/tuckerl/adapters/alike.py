"""Whether environments that are made in the same way are the same, as learning and evaluation must play one world.

A callable may hand out one object again and again, an environment may draw its map when it is made, and a copy may be
made anew instead of copied. All of that is found by comparing data, attribute by attribute.
"""

import copy
import random
from collections.abc import Callable, Iterator, Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np

from tuckerl.adapters.carried import carried_problem, plays_what_it_carries
from tuckerl.adapters.generators import own_generators, seed_generators
from tuckerl.adapters.joint import innermost
from tuckerl.adapters.making import close, name_of
from tuckerl.errors import ProblemError, TuckerlError

_LARGEST = 200_000  # parts that are compared, at most
_EPISODES, _STEPS = 20, 100  # of random play, at most
_INNER = ("env", "aec_env")  # where wrappers keep what they wrap; the latter in PettingZoo's aec_to_parallel
_DRAW_NOTHING = {"gymnasium", "pettingzoo", "tuckerl"}  # packages whose wrappers are alike if what they wrap is
_PLAIN = (bool, int, float, complex, str, bytes, np.generic)


def checked_maker(first: Any, make: Callable[[], Any], source: str) -> "EnvironmentMaker | None":
    """Return what makes more of the same.

    None where `make` hands out one object again and again, which is then copied as an instance is.

    Parameters
    ----------
    first
        What it has made.
    make : callable
    source : str
        What it is called in messages.

    Raises
    ------
    ProblemError
        If environments that it makes differ: it draws when they are made, and no seed decides that.
    """
    try:
        second = make()
    except TuckerlError:
        raise
    except Exception:  # noqa: BLE001  # there can be one only, perhaps; whoever needs another is told
        return EnvironmentMaker(make)
    if innermost(second) is innermost(first):
        return None
    place = _difference(first, second)
    if place is not None and _differ(make):
        close(second, source)
        name = getattr(make, "__qualname__", source)
        raise ProblemError(
            f"two environments made by {name} differ (in {place}): something is drawn when they are made, which no "
            "seed decides, so that equal seeds would not give equal results. Say what is drawn (FrozenLake: desc), or "
            "make one environment and pass that"
        )
    return EnvironmentMaker(make, second)


class EnvironmentMaker:
    """Hands out an environment that was made already before it makes others: a callable may have a few only."""

    def __init__(self, make: Callable[[], Any], *made: Any) -> None:
        self._make, self._made = make, list(made)

    def __call__(self) -> Any:
        """Return an environment."""
        return self._made.pop() if self._made else self._make()

    def close(self) -> None:
        """Close what was made already and is not wanted."""
        while self._made:
            env = self._made.pop()
            close(env, name_of(env))


def lost_by_copying(env: Any) -> str | None:
    """Return what a copy has otherwise than an environment that was just reset by the seed 0; None if nothing is lost.

    Only classes that say themselves how they are copied lose anything: Gymnasium's `EzPickle` makes a new one.
    """
    if class_that_says_how(env) is None:
        return None
    try:
        other = copy.deepcopy(env)
        other.reset(seed=0)
    except Exception:  # noqa: BLE001  # whoever needs a copy is told
        return None
    lost = _difference(env, other)
    if lost is not None:
        lost = None if _episodes_are_equal(env, other) else lost  # a counter, perhaps
        env.reset(seed=0)
    close(other, name_of(other))
    return lost


def _difference(one: Any, other: Any) -> str | None:
    """Return where the data of two environments differ, or those of wrappers of users' own; None where they do not."""
    for layers in zip(_layers(one), _layers(other), strict=False):
        if _inner(layers[0]) is not None and type(layers[0]).__module__.partition(".")[0] in _DRAW_NOTHING:
            continue
        place = difference_of_data(*map(_own_data, layers))
        if place is not None:
            return place
    return None


def _own_data(layer: Any) -> Any:
    """Return an object with the attributes of an environment or a wrapper, but for what that wraps."""
    inner = _inner(layer)
    return SimpleNamespace(**{name: part for name, part in _attributes(layer).items() if part is not inner})


def _attributes(layer: Any) -> dict[str, Any]:
    held: dict[str, Any] = getattr(layer, "__dict__", {})
    return held


def _inner(layer: Any) -> Any:
    """Return what a wrapper wraps, None for an environment."""
    held = _attributes(layer)
    return next((held[name] for name in _INNER if hasattr(held.get(name), "step")), None)


def class_that_says_how(env: Any) -> str | None:
    """Return the name of the class, of an environment or a wrapper of it, that says itself how it is copied, if any."""
    return next((type(layer).__name__ for layer in _layers(env) if _copies_by_rule(type(layer))), None)


def _layers(env: Any) -> Iterator[Any]:
    seen: set[int] = set()
    while env is not None and id(env) not in seen:  # one may hold itself under such a name
        seen.add(id(env))
        yield env
        env = _inner(env)


def _copies_by_rule(kind: type) -> bool:
    """Return whether a class says itself how its objects are copied."""
    ways = ("__getstate__", "__reduce__", "__reduce_ex__")
    says = hasattr(kind, "__deepcopy__") or hasattr(kind, "__setstate__")
    return says or any(getattr(kind, way) is not getattr(object, way) for way in ways)


def difference_of_data(first: Any, second: Any, place: str = "") -> str | None:
    """Return where the data of two objects differ, None where it is equal.

    Data are numbers, text, arrays, and what containers and objects hold of these; generators, functions and whatever
    has no attributes are not looked at.
    """
    seen: set[int] = set()
    parts = [(place, first, second)]
    while parts and len(seen) < _LARGEST:
        place, one, other = parts.pop()
        if one is other or id(one) in seen:
            continue
        if isinstance(one, _PLAIN) or isinstance(other, _PLAIN):
            if not (type(one) is type(other) and _equal(one, other)):
                return place
            continue
        seen.add(id(one))
        if type(one) is not type(other):
            if one is None or other is None or isinstance(one, np.ndarray) or isinstance(other, np.ndarray):
                return place
            continue
        try:
            inner = _parts(one, other, place)
        except Exception:  # noqa: BLE001  # whatever classes of others raise when they are compared
            return place
        if inner is None:
            return place
        parts.extend(reversed(inner))
    return None


def _parts(one: Any, other: Any, place: str) -> list[tuple[str, Any, Any]] | None:
    """Return the parts of two objects of one type, side by side; None where they have not the same."""
    if isinstance(one, np.ndarray):
        if one.shape == other.shape and one.dtype == other.dtype == object:
            return [(f"{place}.flat[{i}]", *pair) for i, pair in enumerate(zip(one.flat, other.flat, strict=True))]
        return [] if _equal_arrays(one, other) else None
    if isinstance(one, Mapping):
        if one.keys() != other.keys():
            return None
        return [(f"{place}[{key!r}]", one[key], other[key]) for key in one]
    if isinstance(one, (list, tuple)):
        if len(one) != len(other):
            return None
        return [(f"{place}[{i}]", *pair) for i, pair in enumerate(zip(one, other, strict=True))]
    if isinstance(one, (set, frozenset)):
        return [] if one == other or not all(isinstance(part, _PLAIN) for part in (*one, *other)) else None
    if isinstance(one, (np.random.Generator, type)) or callable(one):
        return []
    mine, others = getattr(one, "__dict__", {}), getattr(other, "__dict__", {})
    names = [name for name in mine if name in others and name not in {"_np_random", "_np_random_seed"}]
    return [(f"{place}.{name}".lstrip("."), mine[name], others[name]) for name in names]


def _equal(one: Any, other: Any) -> bool:
    try:
        return bool(one == other or (one != one and other != other))
    except Exception:  # noqa: BLE001  # a structured scalar, perhaps
        return False


def _equal_arrays(one: Any, other: Any) -> bool:
    if one.shape != other.shape or one.dtype != other.dtype:
        return False
    return bool(np.array_equal(one, other, equal_nan=one.dtype.kind in "fc"))


def _differ(make: Callable[[], Any]) -> bool:
    """Return whether two more environments are other problems: by their tables, or when they are played alike."""
    made: list[Any] = []
    try:
        made.append(make())
        made.append(make())
        pair = [innermost(env) for env in made]
        if all(map(plays_what_it_carries, pair)):
            tables: list[Any] = [carried_problem(env) for env in pair]
            if None not in tables and tables[0].difference(tables[1]) is not None:
                return True
        return not _episodes_are_equal(*made)
    except Exception:  # noqa: BLE001  # there are no more of them to compare
        return False
    finally:
        for env in made:
            close(env, name_of(env))


def _episodes_are_equal(one: Any, other: Any) -> bool:
    """Return whether two environments play alike where all that they draw from, the global generators too, is seeded.

    The global generators are left as they were.
    """
    before = random.getstate(), np.random.get_state()  # noqa: NPY002  # what others draw from must not change
    try:
        return all(_episode(one, seed) == _episode(other, seed) for seed in range(_EPISODES))
    finally:
        random.setstate(before[0])
        np.random.set_state(before[1])  # noqa: NPY002  # as above


def _episode(env: Any, seed: int) -> list[str]:
    """Return as text what an episode of random actions was like, up to its end or an error."""
    moments: list[str] = []
    try:
        env.reset(seed=seed)  # which may make generators
        random.seed(seed)
        np.random.seed(seed)  # noqa: NPY002  # users' code draws from it
        seed_generators(own_generators(env).generators, np.random.SeedSequence(seed))
        seen = env.reset(seed=seed)
        moments.append(repr(seen[0]))
        choose = _chooser(env, seed)
        for _ in range(_STEPS):
            observation, reward, terminated, truncated, _ = env.step(choose())
            moments.append(repr((observation, reward, terminated, truncated)))
            if not getattr(env, "agents", True) or terminated is True or truncated is True:
                break
    except Exception as error:  # noqa: BLE001  # an illegal action, perhaps
        moments.append(type(error).__name__)
    return moments


def _chooser(env: Any, seed: int) -> Callable[[], Any]:
    """Return what chooses random actions: one, or by agent those that are there."""
    if not hasattr(env, "possible_agents") or not callable(getattr(env, "action_space", None)):
        space = copy.deepcopy(env.action_space)
        space.seed(seed)
        return space.sample
    spaces = {agent: copy.deepcopy(env.action_space(agent)) for agent in env.possible_agents}
    for place, space in enumerate(spaces.values()):
        space.seed(seed + place)
    return lambda: {agent: spaces[agent].sample() for agent in env.agents}
