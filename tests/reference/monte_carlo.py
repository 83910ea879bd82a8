"""On-policy Monte Carlo control line by line (the box of Sutton and Barto 2018, section 5.4).

The book has no time limits: what one cuts off is taken to return what the policy's next action is worth.
"""

from typing import Any

import numpy as np

from tests.reference.expected_sarsa import ExpectedSarsaLearner
from tests.reference.q_learning import Table


class MonteCarloLearner(ExpectedSarsaLearner):
    """One agent that keeps all returns of all pairs, or moves values by alpha instead."""

    def __init__(self, *args: Any, visits: str = "first", averages: bool = True, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.visits, self.averages = visits, averages
        self.returns: dict[tuple[int, int], list[float]] = {}

    def episode(self, omega: Table) -> tuple[int, float]:
        s = self.world.first(self.stream)
        self.trajectory = [s]
        pairs: list[tuple[int, int]] = []
        rewards: list[float] = []
        terminated = False
        while not terminated and len(rewards) < self.world.limit:
            pairs.append((s, self.policy(s)))
            s, r, terminated = self.world.step(*pairs[-1], self.stream)
            rewards.append(r)
            self.trajectory.append(s)
        g = 0.0 if self.is_end(terminated) else self.expected(s)
        for t in range(len(rewards) - 1, -1, -1):
            g = self.gamma * g + rewards[t]
            if self.visits == "every" or pairs[t] not in pairs[:t]:
                self.learn(*pairs[t], g, omega)
        self.epsilon *= self.decay
        return len(rewards), sum(rewards)

    def learn(self, s: int, a: int, g: float, omega: Table) -> None:
        if self.averages:
            self.returns.setdefault((s, a), []).append(g)
            self.q[s, a] = np.mean(self.returns[s, a])
        else:
            self.q[s, a] = self.q[s, a] + self.alpha * omega[a] * (g - self.q[s, a])
