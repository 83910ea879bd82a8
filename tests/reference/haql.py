"""HAQL line by line (Bianchi, Ribeiro and Costa 2008), the heuristic being a distance of states from the goal."""

from typing import Any

import numpy as np

from tests.reference.q_learning import QLearner, Table


class HAQLearner(QLearner):
    """One agent of Q-learning, whose choice of actions a heuristic helps."""

    def __init__(self, *args: Any, heuristic: Table, xi: float = 0.5, eta: float = 1.0, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.heuristic, self.xi, self.eta = heuristic, xi, eta
        self.led_to: dict[tuple[int, int], int] = {}
        self.n_suggested = 0

    def pi_h(self, state: int) -> int | None:
        """The action that is known to lead nearest to the goal, if that is nearer than where the agent is."""
        known = [a for a in self.world.allowed(state) if (state, a) in self.led_to]
        distance = {a: float(self.heuristic[self.led_to[state, a]]) for a in known}
        nearer = [a for a in known if distance[a] < self.heuristic[state]]
        return min(nearer, key=lambda a: (distance[a], a)) if nearer else None

    def h(self, state: int) -> Table:
        """H(s, .): by how much the suggested action lies below the best, and eta; 0 for all others."""
        values, suggested = np.zeros(self.world.n_actions), self.pi_h(state)
        if suggested is not None:
            self.n_suggested += 1
            values[suggested] = self.value(state) - self.q[state, suggested] + self.eta
        return values

    def policy(self, state: int) -> int:
        allowed = self.world.allowed(state)
        if self.stream.uniform() < self.epsilon:
            return allowed[self.stream.below(len(allowed))]
        preferences = self.q[state] + self.xi * self.h(state)
        largest = max(preferences[a] for a in allowed)
        best = [a for a in allowed if preferences[a] == largest]
        return self.stream.choice(best) if self.ties == "random" else best[0]

    def after(self, s: int, a: int, r: float, s2: int, terminated: bool, omega: Table) -> None:
        self.led_to[s, a] = s2
