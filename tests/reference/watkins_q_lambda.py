"""Watkins' Q(lambda) line by line: the sweep over all pairs at every step, and traces that are cut.

Sutton and Barto 1998, section 7.6, but that the next action is chosen after the update, as Q-learning chooses it.
"""

import math
from typing import Any

from tests.reference.q_learning import Table
from tests.reference.sarsa_lambda import SarsaLambdaLearner


class WatkinsQLambdaLearner(SarsaLambdaLearner):
    """One agent; `cut_traces` False lets traces go on past actions that are not greedy."""

    def __init__(self, *args: Any, cut_traces: bool = True, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.cut_traces = cut_traces
        self.n_cuts = 0

    def episode(self, omega: Table) -> tuple[int, float]:
        self.begin_episode()
        s = self.world.first(self.stream)
        self.trajectory = [s]
        steps, total, terminated = 0, 0.0, False
        while not terminated and steps < self.world.limit:
            a = self.policy(s)
            best = self.value(s)
            if self.cut_traces and self.q[s, a] < best and not math.isclose(self.q[s, a], best, rel_tol=1e-12):
                self.n_cuts += 1
                self.e[:, :] = 0.0
            s2, r, terminated = self.world.step(s, a, self.stream)
            delta = r + self.discount(terminated) * self.value(s2) - self.q[s, a]
            self.learn(s, a, delta, omega)
            s = s2
            steps += 1
            total += r
            self.trajectory.append(s)
        self.epsilon *= self.decay
        return steps, total
