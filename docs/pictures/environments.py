"""Draw the environments by their own ``rgb_array``; ``python docs/pictures/environments.py`` writes them here."""

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pettingzoo
from PIL import Image

import tuckerl

HERE = Path(__file__).parent


def save(image: Any, name: str) -> None:
    """Write a picture of few colours."""
    Image.fromarray(image).quantize(64, dither=Image.Dither.NONE).save(HERE / f"{name}.png", optimize=True)


def beside(*images: Any) -> Any:
    """Put pictures of equal height side by side."""
    gap = np.full((images[0].shape[0], 24, 3), 255, dtype=np.uint8)
    parts = [part for image in images for part in (image, gap)]
    return np.concatenate(parts[:-1], axis=1)


def dyna_maze() -> None:
    """Show the way that an agent has learned."""
    env = gymnasium.make("tuckerl/DynaMaze-v0", render_mode="rgb_array")
    agent = tuckerl.DynaH("tuckerl/DynaMaze-v0", planning_steps=50, alpha=0.5, seed=0).learn(episodes=100)
    state, _ = env.reset()
    ended = False
    while not ended:
        state, _, ended, truncated, _ = env.step(agent.predict(state)[0])
        ended = ended or truncated
    save(env.render(), "dyna-maze")


def cart_pole() -> None:
    """Show the start, and a pole that leans."""
    env = gymnasium.make("tuckerl/CartPole-v0", render_mode="rgb_array")
    env.reset()
    start = env.render()
    for action in (8, 8, 8, 8, 6, 6, 6, 6, 6, 4, 4, 4, 4, 4, 4, 4, 16, 16, 18, 20):
        env.step(action)
    save(beside(start, env.render()), "cart-pole")


def robot_rescue() -> None:
    """Show the start, and the object on its way home."""
    env = pettingzoo.make("parallel", "tuckerl/RobotRescue-v0", render_mode="rgb_array")
    env.reset()
    start = env.render()
    for first, second in ((1, 0), (1, 0), (1, 4), (1, 2), (2, 2), (2, 0), (4, 4), (2, 2), (2, 2)):
        env.step({"robot_0": first, "robot_1": second})
    save(beside(start, env.render()), "robot-rescue")


if __name__ == "__main__":
    dyna_maze()
    cart_pole()
    robot_rescue()
