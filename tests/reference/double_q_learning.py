"""Double Q-learning line by line (the box of Sutton and Barto 2018, section 6.7)."""

from typing import Any

from tests.reference.q_learning import QLearner, Table


class DoubleQLearner(QLearner):
    """One agent with two tables, which acts by their mean."""

    def __init__(self, *args: Any, bootstrap_terminal: bool = False, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.bootstrap_terminal = bootstrap_terminal
        self.q1, self.q2 = self.q.copy(), self.q.copy()

    def update(self, s: int, a: int, r: float, s2: int, terminated: bool, omega: Table) -> None:
        if self.stream.uniform() < 0.5:
            self.move(self.q2, self.q1, s, a, r, s2, terminated, omega)
        else:
            self.move(self.q1, self.q2, s, a, r, s2, terminated, omega)
        self.q[s, a] = (self.q1[s, a] + self.q2[s, a]) / 2

    def move(
        self, table: Table, other: Table, s: int, a: int, r: float, s2: int, terminated: bool, omega: Table
    ) -> None:
        allowed = self.world.allowed(s2)
        value = max(float(table[s2, b]) for b in allowed)
        best = [b for b in allowed if table[s2, b] == value]
        b = self.stream.choice(best) if self.ties == "random" else best[0]
        there = 0.0 if terminated and not self.bootstrap_terminal else other[s2, b]
        table[s, a] = table[s, a] + self.alpha * omega[a] * (r + self.gamma * there - table[s, a])
