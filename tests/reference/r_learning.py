"""R-learning line by line (Sutton and Barto 1998, figure 6.16), as one experience that goes on past the ends."""

from typing import Any

from tests.reference.q_learning import QLearner, Table


class RLearner(QLearner):
    """One agent; after an end it is in the next episode's first state."""

    def __init__(self, *args: Any, beta: float = 0.01, bootstrap_terminal: bool = False, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.beta, self.bootstrap_terminal = beta, bootstrap_terminal
        self.rho = 0.0
        self.last: tuple[int, int, float] | None = None

    def r_update(self, s: int, a: int, r: float, s2: int, omega: Table) -> None:
        self.q[s, a] = self.q[s, a] + self.alpha * omega[a] * (r - self.rho + self.value(s2) - self.q[s, a])
        if self.q[s, a] == self.value(s):
            self.rho = self.rho + self.beta * (r - self.rho + self.value(s2) - self.value(s))

    def episode(self, omega: Table) -> tuple[int, float]:
        s = self.world.first(self.stream)
        if self.last is not None:
            self.r_update(*self.last, s, omega)
            self.last = None
        self.trajectory = [s]
        steps, total, terminated = 0, 0.0, False
        while not terminated and steps < self.world.limit:
            a = self.policy(s)
            s2, r, terminated = self.world.step(s, a, self.stream)
            if terminated and not self.bootstrap_terminal:
                self.last = (s, a, r)
            else:
                self.r_update(s, a, r, s2, omega)
            s = s2
            steps += 1
            total += r
            self.trajectory.append(s)
        self.epsilon *= self.decay
        return steps, total
