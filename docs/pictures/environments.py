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
    agent = tuckerl.QLearning("tuckerl/DynaMaze-v0", alpha=0.5, seed=0).learn(episodes=3000)
    state, _ = env.reset()
    ended = False
    while not ended:
        state, _, terminated, truncated, _ = env.step(agent.predict(state)[0])
        ended = terminated or truncated
    save(env.render(), "dyna-maze")


def cart_pole() -> None:
    """Show a pole that leans and a push that is to help."""
    env = gymnasium.make("tuckerl/CartPole-v0", render_mode="rgb_array")
    env.reset()
    for action in (8, 8, 8, 8, 6, 6, 6, 6, 6, 4, 4, 4, 4, 4, 4, 4, 16, 16, 18, 20):
        env.step(action)
    save(env.render(), "cart-pole")


def robot_rescue() -> None:
    """Show the start, and the object on its way home."""
    env = pettingzoo.make("parallel", "tuckerl/RobotRescue-v0", render_mode="rgb_array")
    env.reset()
    start = env.render()
    for joint in shortest(tuckerl.robot_rescue())[:10]:
        first, second = divmod(joint, 5)
        env.step({"robot_0": first, "robot_1": second})
    save(beside(start, env.render()), "robot-rescue")


def shortest(mdp: tuckerl.TabularMDP) -> list[int]:
    """Return the actions of one shortest episode of a deterministic problem (breadth-first)."""
    arrays = mdp.arrays
    frontier = [int(arrays.start_state[0])]
    way: dict[int, list[int]] = {frontier[0]: []}
    for state in frontier:
        for action in range(mdp.n_actions):
            outcome = state * mdp.n_actions + action
            there = int(arrays.next_state[outcome])
            if arrays.terminated[outcome]:
                return [*way[state], action]
            if there not in way:
                way[there] = [*way[state], action]
                frontier.append(there)
    raise ValueError("no episode ends")


if __name__ == "__main__":
    dyna_maze()
    cart_pole()
    robot_rescue()
