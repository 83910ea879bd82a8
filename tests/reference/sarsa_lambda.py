"""SARSA(lambda) line by line (Figures 2 and 8): the sweep over all pairs at every step."""

from typing import Any

import numpy as np

from tests.reference.q_learning import Table
from tests.reference.sarsa import SarsaLearner


class SarsaLambdaLearner(SarsaLearner):
    """One agent with a trace for every pair."""

    def __init__(
        self, *args: Any, lambda_: float, trace: str = "replacing", carry_trace: bool = False, **kwargs: Any
    ) -> None:
        super().__init__(*args, **kwargs)
        self.lambda_, self.trace, self.carry_trace = lambda_, trace, carry_trace
        self.e = np.zeros_like(self.q)

    def begin_episode(self) -> None:
        if not self.carry_trace:
            self.e[:, :] = 0.0

    def learn(self, s: int, a: int, delta: float, omega: Table) -> None:
        self.e[s, a] = 1.0 if self.trace == "replacing" else self.e[s, a] + 1.0
        self.q += self.alpha * omega * delta * self.e  # for all s, a
        self.e *= self.gamma * self.lambda_
