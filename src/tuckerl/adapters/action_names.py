"""What the actions of environments are called."""

from typing import Any

from gymnasium.envs.classic_control import CartPoleEnv, MountainCarEnv
from gymnasium.envs.toy_text import BlackjackEnv, CliffWalkingEnv, FrozenLakeEnv, TaxiEnv

from tuckerl.adapters.joint import innermost
from tuckerl.problems.parts import joint_names

_KNOWN: dict[type, tuple[str, ...]] = {
    BlackjackEnv: ("stick", "hit"),
    CartPoleEnv: ("push left", "push right"),
    CliffWalkingEnv: ("up", "right", "down", "left"),
    FrozenLakeEnv: ("left", "down", "right", "up"),
    MountainCarEnv: ("push left", "no push", "push right"),
    TaxiEnv: ("south", "north", "east", "west", "pick up", "drop off"),
}
"""Those of Gymnasium's environments, which do not say it themselves."""


def action_names_of(env: Any, action_sizes: tuple[int, ...]) -> tuple[str, ...] | None:
    """Return what an environment's actions are called, joint ones by all agents' names; None where it is not known.

    An environment of anybody's says it by an attribute ``action_names``, a tuple or list of strings; all agents of a
    parallel environment have the same.
    """
    inner = innermost(env)
    own = getattr(inner, "action_names", None)
    if not isinstance(own, (tuple, list)):
        own = next((names for kind, names in _KNOWN.items() if isinstance(inner, kind)), ())
    if any(size != len(own) for size in action_sizes):
        return None
    return joint_names([[str(name) for name in own]] * len(action_sizes))
