"""Tabular Dyna-Q and Dyna-Q+ line by line (Sutton and Barto 2018, the box of section 8.2, and section 8.3)."""

import math
from typing import Any

from tests.reference.q_learning import QLearner, Table


class DynaQLearner(QLearner):
    """One agent with its model."""

    def __init__(self, *args: Any, planning_steps: int, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.planning_steps = planning_steps
        self.model: dict[tuple[int, int], tuple[float, int, bool]] = {}  # (e): reward, next state, whether it ended

    def after(self, s: int, a: int, r: float, s2: int, terminated: bool, omega: Table) -> None:
        """(e) and (f) of the box; a pair keeps its place when its outcome is replaced."""
        self.model[s, a] = (r, s2, terminated)
        for _ in range(self.planning_steps):
            observed = list(dict.fromkeys(state for state, _ in self.model))  # in the order of their first visit
            now = observed[self.stream.below(len(observed))]
            self.plan(now, omega)

    def plan(self, now: int, omega: Table) -> None:
        """One planning step in an observed state."""
        tried = [a for state, a in self.model if state == now]
        action = tried[self.stream.below(len(tried))]
        reward, planned, ends = self.model[now, action]
        self.update(now, action, reward, planned, ends, omega)


class DynaQPlusLearner(DynaQLearner):
    """One agent that is curious about what it has not tried for long."""

    def __init__(self, *args: Any, kappa: float, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.kappa, self.time = kappa, 0
        self.last_tried: dict[tuple[int, int], int] = {}

    def after(self, s: int, a: int, r: float, s2: int, terminated: bool, omega: Table) -> None:
        """Look at the clock, then plan."""
        self.time += 1
        self.last_tried[s, a] = self.time
        super().after(s, a, r, s2, terminated, omega)

    def plan(self, now: int, omega: Table) -> None:
        """Actions that were never tried lead back to the same state with reward 0; tau counts from the beginning."""
        allowed = self.world.allowed(now)
        action = allowed[self.stream.below(len(allowed))]
        reward, planned, ends = self.model.get((now, action), (0.0, now, False))
        tau = self.time - self.last_tried.get((now, action), 0)
        self.update(now, action, reward + self.kappa * math.sqrt(tau), planned, ends, omega)
