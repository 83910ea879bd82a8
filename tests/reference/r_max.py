"""R-max line by line (Brafman and Tennenholtz 2002, the algorithm of section 3), with pairs in the place of states."""

from typing import Any

import numpy as np

from tests.reference.q_learning import QLearner, Table


class RMaxLearner(QLearner):
    """One agent with its model; Q begins with the largest value that there can be."""

    def __init__(self, *args: Any, m: int, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.m = m
        self.trials: dict[tuple[int, int], list[tuple[float, int, bool]]] = {}  # reward, next state, whether it ended

    def update(self, s: int, a: int, r: float, s2: int, terminated: bool, omega: Table) -> None:
        """Observe; when a pair becomes known, compute the policy anew."""
        tried = self.trials.setdefault((s, a), [])
        if len(tried) < self.m:
            tried.append((r, s2, terminated))
            if len(tried) == self.m:
                self.iterate()

    def iterate(self) -> None:
        """Value iteration over the known pairs; all others stay as good as can be."""
        known = [pair for pair, tried in self.trials.items() if len(tried) == self.m]
        change = np.inf
        while change > 1e-13:
            before = self.q.copy()
            for s, a in known:
                targets = [
                    r + (0.0 if ended else self.gamma * self.best(before, s2)) for r, s2, ended in self.trials[s, a]
                ]
                self.q[s, a] = sum(targets) / self.m
            change = float(np.abs(self.q - before).max())

    def best(self, q: Table, s: int) -> float:
        """The largest value of an action that may be taken."""
        return max(float(q[s, a]) for a in self.world.allowed(s))
