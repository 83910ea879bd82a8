"""True online SARSA(lambda) line by line (Sutton and Barto 2018, section 12.7), and the forward view that it equals."""

from typing import Any, NamedTuple

import numpy as np

from tests.reference.q_learning import Table
from tests.reference.sarsa import SarsaLearner


class TrueOnlineSarsaLambdaLearner(SarsaLearner):
    """One agent: the book's box with one feature for each pair, w being Q, and alpha weighted by omega."""

    def __init__(self, *args: Any, lambda_: float, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.lambda_ = lambda_
        self.z = np.zeros_like(self.q)
        self.q_old = 0.0

    def begin_episode(self) -> None:
        self.z[:, :] = 0.0
        self.q_old = 0.0
        self.experience: list[Step] = []

    def episode(self, omega: Table) -> tuple[int, float]:
        self.begin_episode()
        s = self.world.first(self.stream)
        a = self.policy(s)
        self.trajectory = [s]
        steps, total, terminated = 0, 0.0, False
        while not terminated and steps < self.world.limit:
            s2, r, terminated = self.world.step(s, a, self.stream)
            a2 = self.policy(s2)
            gamma = self.discount(terminated)
            alpha = self.alpha * omega[a]
            x = np.zeros_like(self.q)
            x[s, a] = 1.0
            q, q_next = self.q[s, a], self.q[s2, a2]
            delta = r + gamma * q_next - q
            decay = self.gamma * self.lambda_
            self.z = decay * self.z + (1.0 - alpha * decay * self.z[s, a]) * x
            self.q = self.q + self.alpha * omega * (delta + q - self.q_old) * self.z - alpha * (q - self.q_old) * x
            self.q_old = q_next
            self.experience.append(Step(s, a, r, gamma, float(q_next)))
            s, a = s2, a2
            steps += 1
            total += r
            self.trajectory.append(s)
        self.epsilon *= self.decay
        return steps, total


class Step(NamedTuple):
    """A step of an episode, and the value that it bootstraps from: that of the pair it led to, when it was taken."""

    s: int
    a: int
    r: float
    gamma: float
    q_next: float


def online_lambda_return(q: Table, steps: list[Step], lambda_: float, alpha: Table) -> Table:
    """Return what the online lambda-return algorithm makes of a table in an episode (section 12.4).

    At the last step it begins anew: from the episode's first table, every pair in turn moves towards its lambda-return
    as far as it is known by then. `alpha` (A,) has a step size for each action.
    """
    q, h = q.copy(), len(steps)
    for t in range(h):
        lambda_return, weight, discounted, discount = 0.0, 1.0, 0.0, 1.0
        for k in range(t, h):
            discounted += discount * steps[k].r
            discount *= steps[k].gamma
            n_step_return = discounted + discount * steps[k].q_next
            is_last = k == h - 1
            lambda_return += weight * (1.0 if is_last else 1.0 - lambda_) * n_step_return
            weight *= lambda_
        q[steps[t].s, steps[t].a] += alpha[steps[t].a] * (lambda_return - q[steps[t].s, steps[t].a])
    return q
