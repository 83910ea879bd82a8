"""Prioritized sweeping for a deterministic environment line by line (Sutton and Barto 2018, the box of section 8.4)."""

from typing import Any

from tests.reference.q_learning import QLearner, Table


class PrioritizedSweepingLearner(QLearner):
    """One agent with its model and its queue."""

    def __init__(self, *args: Any, planning_steps: int, theta: float, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.planning_steps, self.theta = planning_steps, theta
        self.model: dict[tuple[int, int], tuple[float, int, bool]] = {}  # reward, next state, whether the return ended
        self.queue: dict[tuple[int, int], float] = {}
        self.n_updates = 0

    def update(self, s: int, a: int, r: float, s2: int, terminated: bool, omega: Table) -> None:
        """The box has no update at (d) or (e): all are at (g)."""

    def priority(self, s: int, a: int) -> float:
        """P <- |R + gamma max_a Q(S', a) - Q(S, A)|, of the model."""
        r, s2, ended = self.model[s, a]
        value = 0.0 if ended else self.value(s2)
        return float(abs(r + self.gamma * value - self.q[s, a]))

    def insert(self, s: int, a: int) -> None:
        """Insertion results in only the higher priority entry remaining in the queue."""
        if self.priority(s, a) > self.theta:
            self.queue[s, a] = max(self.priority(s, a), self.queue.get((s, a), 0.0))

    def after(self, s: int, a: int, r: float, s2: int, terminated: bool, omega: Table) -> None:
        """(d) to (g) of the box; of equal priorities the smaller state, then the smaller action, goes first."""
        self.model[s, a] = (r, s2, terminated)
        self.insert(s, a)
        for _ in range(self.planning_steps):
            if not self.queue:
                break
            s, a = min(self.queue, key=lambda pair: (-self.queue[pair], pair))
            del self.queue[s, a]
            r, s2, terminated = self.model[s, a]
            super().update(s, a, r, s2, terminated, omega)
            self.n_updates += 1
            for (earlier, leading), (_, then, ended) in self.model.items():
                if then == s and not ended and self.gamma > 0.0:
                    self.insert(earlier, leading)
