"""Q-learning by table-rl, in its own environment: prints how many steps a second it takes, as JSON."""

import json
import sys
import time

import gymnasium
from table_rl.explorers.epsilon_greedy import ConstantEpsilonGreedy  # type: ignore[import-not-found]  # only there
from table_rl.learners.q_learning import QLearning  # type: ignore[import-not-found]
from table_rl.step_size_schedulers.basic_step_size_schedulers import (  # type: ignore[import-not-found]
    ConstantStepSize,
)


def steps_per_second(name: str, steps: int, alpha: float, gamma: float, epsilon: float, initial_q: float) -> float:
    """Learn for as many steps, after a tenth of them to warm up."""
    env = gymnasium.make(name)
    n_states, n_actions = int(env.observation_space.n), int(env.action_space.n)  # type: ignore[attr-defined]
    explorer = ConstantEpsilonGreedy(epsilon, n_actions)
    learner = QLearning(n_states, n_actions, ConstantStepSize(alpha), explorer, gamma, initial_q)
    state, _ = env.reset(seed=0)
    before = 0.0
    for step in range(-(steps // 10), steps):
        if step == 0:
            before = time.perf_counter()
        action = learner.act(state, True)
        state, reward, terminated, truncated, _ = env.step(action)
        learner.observe(state, float(reward), terminated, truncated, True)
        if terminated or truncated:
            state, _ = env.reset()
    return steps / (time.perf_counter() - before)


if __name__ == "__main__":
    rate = steps_per_second(sys.argv[1], int(sys.argv[2]), *map(float, sys.argv[3:7]))
    print(json.dumps({"steps_per_second": rate}))
