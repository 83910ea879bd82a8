"""n-step SARSA line by line (the box of Sutton and Barto 2018, section 7.2).

The book has no time limits. At one, as at an end, T is the last step, but the value of the pair that would have come
next is bootstrapped from.
"""

import math
from typing import Any

from tests.reference.expected_sarsa import ExpectedSarsaLearner
from tests.reference.q_learning import Table


class NStepSarsaLearner(ExpectedSarsaLearner):
    """One agent that keeps its whole episode."""

    def __init__(self, *args: Any, n: int, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.n = n

    def episode(self, omega: Table) -> tuple[int, float]:
        states = [self.world.first(self.stream)]
        actions = [self.policy(states[0])]
        rewards = [math.nan]  # R_0 is none
        n, end, is_end, t, tau = self.n, math.inf, False, 0, -1
        while tau != end - 1:
            if t < end:
                s2, r, terminated = self.world.step(states[t], actions[t], self.stream)
                states.append(s2)
                rewards.append(r)
                if terminated or t + 1 == self.world.limit:
                    end, is_end = t + 1, self.is_end(terminated)
                actions.append(self.policy(s2))
            tau = t - n + 1
            if tau >= 0:
                last = int(min(tau + n, end))
                g = self.target(states, actions, rewards, tau, last, is_end and last == end)
                s, a = states[tau], actions[tau]
                self.q[s, a] = self.q[s, a] + self.alpha * omega[a] * (g - self.q[s, a])
            t += 1
        self.trajectory = states
        self.epsilon *= self.decay
        return len(states) - 1, sum(rewards[1:])

    def target(
        self, states: list[int], actions: list[int], rewards: list[float], tau: int, last: int, ends: bool
    ) -> float:
        """G from R_(tau + 1) to R_last and, unless the return ends there, the value of the pair then."""
        g = sum(self.gamma ** (i - tau - 1) * rewards[i] for i in range(tau + 1, last + 1))
        if not ends:
            g += self.gamma ** (last - tau) * self.q[states[last], actions[last]]
        return g
