"""SARSA line by line (equation 4, weighted by omega as in Figure 5)."""

from typing import Any

import numpy as np

from tests.reference.q_learning import QLearner, Table


class SarsaLearner(QLearner):
    """One agent that learns from the action it takes next."""

    def __init__(self, *args: Any, bootstrap_terminal: bool = False, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.bootstrap_terminal = bootstrap_terminal

    def discount(self, terminated: bool) -> float:
        return 0.0 if terminated and not self.bootstrap_terminal else self.gamma

    def begin_episode(self) -> None:
        """What is done before an episode: nothing."""

    def learn(self, s: int, a: int, delta: float, omega: Table) -> None:
        self.q[s, a] = self.q[s, a] + self.alpha * omega[a] * delta

    def episode(self, omega: Table) -> tuple[int, float]:
        self.begin_episode()
        s = self.world.first(self.stream)
        a = self.policy(s)
        self.trajectory = [s]
        steps, total, terminated = 0, 0.0, False
        while not terminated and steps < self.world.limit:
            s2, r, terminated = self.world.step(s, a, self.stream)
            a2 = self.policy(s2)
            with np.errstate(over="ignore", invalid="ignore"):
                delta = r + self.discount(terminated) * self.q[s2, a2] - self.q[s, a]
                self.learn(s, a, delta, omega)
            s, a = s2, a2
            steps += 1
            total += r
            self.trajectory.append(s)
        self.epsilon *= self.decay
        return steps, total
