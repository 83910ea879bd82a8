"""n-step tree backup line by line (the box of Sutton and Barto 2018, section 7.5)."""

from typing import Any

from tests.reference.n_step_sarsa import NStepSarsaLearner


class TreeBackupLearner(NStepSarsaLearner):
    """One agent whose target policy is the greedy one, or the one that it acts by."""

    def __init__(self, *args: Any, target: str = "greedy", **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.target_policy = target

    def pi(self, state: int) -> list[float]:
        """The target policy."""
        kept = self.epsilon
        self.epsilon = 0.0 if self.target_policy == "greedy" else kept
        pi = self.probabilities(state)
        self.epsilon = kept
        return pi

    def target(
        self, states: list[int], actions: list[int], rewards: list[float], tau: int, last: int, ends: bool
    ) -> float:
        leaf = sum(p * float(self.q[states[last], a]) for a, p in enumerate(self.pi(states[last])))
        g = rewards[last] + (0.0 if ends else self.gamma * leaf)
        for k in range(last - 1, tau, -1):
            pi = self.pi(states[k])
            others = sum(p * float(self.q[states[k], a]) for a, p in enumerate(pi) if a != actions[k])
            g = rewards[k] + self.gamma * others + self.gamma * pi[actions[k]] * g
        return g
