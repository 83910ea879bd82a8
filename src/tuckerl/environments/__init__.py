"""The built-in environments, registered with Gymnasium and PettingZoo.

To add one, write its file and list it in `ENVIRONMENTS` or, for several agents, in `PARALLEL_ENVIRONMENTS`.
"""

import gymnasium
import pettingzoo

ENVIRONMENTS = {
    "tuckerl/CartPole-v0": {"entry_point": "tuckerl.environments.cart_pole:CartPoleEnv", "max_episode_steps": 1000},
    "tuckerl/DynaMaze-v0": {"entry_point": "tuckerl.environments.dyna_maze:DynaMazeEnv", "max_episode_steps": 2000},
}
"""The entries of Gymnasium's registry, by id."""

PARALLEL_ENVIRONMENTS = {
    "tuckerl/RobotRescue-v0": {"entry_point": "tuckerl.environments.robot_rescue_env:parallel_env", "max_cycles": 1000},
}
"""The entries of PettingZoo's registry of parallel environments, by id."""


def register_environments() -> None:
    """Register all environments with Gymnasium and PettingZoo; those that are registered already stay as they are."""
    for name, specification in ENVIRONMENTS.items():
        if name not in gymnasium.registry:
            gymnasium.register(name, **specification)  # type: ignore[arg-type]  # a mapping of keywords
    for name, specification in PARALLEL_ENVIRONMENTS.items():
        if name not in pettingzoo.parallel_registry:
            pettingzoo.register("parallel", name, **specification)
