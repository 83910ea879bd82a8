"""Softmax and upper confidence bounds line by line (Sutton and Barto 2018, sections 2.7 and 2.8), in Q-learning."""

import math
from typing import Any

from tests.reference.q_learning import QLearner


class SoftmaxLearner(QLearner):
    """Q-learning that draws actions by e^(Q / temperature)."""

    def __init__(self, *args: Any, temperature: float, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.temperature = temperature

    def policy(self, state: int) -> int:
        allowed = self.world.allowed(state)
        best = self.value(state)
        weights = [math.exp((self.q[state, a] - best) / self.temperature) for a in allowed]
        left = self.stream.uniform() * sum(weights)
        for a, weight in zip(allowed, weights, strict=True):
            left -= weight
            if left < 0:
                return a
        return allowed[-1]


class UCBLearner(QLearner):
    """Q-learning that takes the action of the largest upper confidence bound."""

    def __init__(self, *args: Any, c: float, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.c = c
        self.chosen: list[tuple[int, int]] = []  # all choices so far

    def policy(self, state: int) -> int:
        n = [self.chosen.count((state, a)) for a in range(self.world.n_actions)]
        allowed = self.world.allowed(state)
        t = 1 + sum(n[a] for a in allowed)
        bounds = {
            a: math.inf if n[a] == 0 else self.q[state, a] + self.c * math.sqrt(math.log(t) / n[a]) for a in allowed
        }
        best = [a for a in allowed if bounds[a] == max(bounds.values())]
        a = self.stream.choice(best) if self.ties == "random" else best[0]
        self.chosen.append((state, a))
        return a
