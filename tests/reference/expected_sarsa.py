"""Expected SARSA line by line (Sutton and Barto 2018, equation 6.9)."""

from typing import Any

from tests.reference.q_learning import QLearner, Table


class ExpectedSarsaLearner(QLearner):
    """One agent that learns from the mean over its epsilon-greedy policy's next action."""

    def __init__(self, *args: Any, bootstrap_terminal: bool = False, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.bootstrap_terminal = bootstrap_terminal

    def probabilities(self, state: int) -> list[float]:
        """pi(. | s), epsilon-greedy."""
        allowed = self.world.allowed(state)
        value = self.value(state)
        best = [a for a in allowed if self.q[state, a] == value]
        if self.ties == "first":
            best = best[:1]
        pi = [0.0] * self.world.n_actions
        for a in allowed:
            pi[a] += self.epsilon / len(allowed)
        for a in best:
            pi[a] += (1.0 - self.epsilon) / len(best)
        return pi

    def expected(self, state: int) -> float:
        """The sum of pi(a | s) Q(s, a) over all a."""
        return sum(p * float(self.q[state, a]) for a, p in enumerate(self.probabilities(state)))

    def is_end(self, terminated: bool) -> bool:
        """Whether the value of where a step led is 0."""
        return terminated and not self.bootstrap_terminal

    def update(self, s: int, a: int, r: float, s2: int, terminated: bool, omega: Table) -> None:
        value = 0.0 if self.is_end(terminated) else self.expected(s2)
        self.q[s, a] = self.q[s, a] + self.alpha * omega[a] * (r + self.gamma * value - self.q[s, a])
