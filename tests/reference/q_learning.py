"""Q-learning line by line (Figures 1 and 5), for worlds given as tables of outcomes."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tests.reference.rng import Stream

Table = NDArray[np.float64]


class World(NamedTuple):
    """A finite MDP as lists, small enough to read."""

    outcomes: list[list[list[tuple[float, int, float, bool]]]]  # [s][a]: (probability, s', r, terminated)
    start: list[tuple[float, int]]  # (probability, s)
    limit: int
    action_mask: Sequence[list[bool]] = ()  # [s][a]; empty where everything is allowed

    def allowed(self, state: int) -> list[int]:
        """The actions that may be taken."""
        if not self.action_mask:
            return list(range(self.n_actions))
        return [a for a in range(self.n_actions) if self.action_mask[state][a]]

    @property
    def n_states(self) -> int:
        return len(self.outcomes)

    @property
    def n_actions(self) -> int:
        return len(self.outcomes[0])

    def first(self, stream: Stream) -> int:
        return self.start[draw([p for p, _ in self.start], stream)][1]

    def step(self, state: int, action: int, stream: Stream) -> tuple[int, float, bool]:
        outcomes = self.outcomes[state][action]
        _, next_state, reward, terminated = outcomes[draw([p for p, *_ in outcomes], stream)]
        return next_state, reward, terminated


def draw(probabilities: list[float], stream: Stream) -> int:
    """An index by probability; nothing is drawn where there is only one."""
    if len(probabilities) == 1:
        return 0
    u = stream.uniform()
    total = 0.0
    for index, probability in enumerate(probabilities):
        total += probability
        if u < total:
            return index
    return len(probabilities) - 1


class QLearner:
    """One agent of Figure 1, its learning rate weighted by omega as in Figure 5."""

    def __init__(
        self,
        world: World,
        stream: Stream,
        alpha: float,
        gamma: float,
        epsilon: float,
        decay: float,
        ties: str,
        q: Table,
    ) -> None:
        self.world, self.stream = world, stream
        self.alpha, self.gamma, self.epsilon, self.decay, self.ties = alpha, gamma, epsilon, decay, ties
        self.q = q.copy()
        self.trajectory: list[int] = []

    def policy(self, state: int) -> int:
        """Epsilon-greedy among the actions that may be taken."""
        allowed = self.world.allowed(state)
        if self.stream.uniform() < self.epsilon:
            return allowed[self.stream.below(len(allowed))]
        value = self.value(state)
        best = [a for a in allowed if self.q[state, a] == value]
        return self.stream.choice(best) if self.ties == "random" else best[0]

    def value(self, state: int) -> float:
        """The largest value of an action that may be taken."""
        return max(float(self.q[state, a]) for a in self.world.allowed(state))

    def update(self, s: int, a: int, r: float, s2: int, terminated: bool, omega: Table) -> None:
        value = 0.0 if terminated else self.value(s2)
        self.q[s, a] = self.q[s, a] + self.alpha * omega[a] * (r + self.gamma * value - self.q[s, a])

    def after(self, s: int, a: int, r: float, s2: int, terminated: bool, omega: Table) -> None:
        """What else is done after a real step: nothing."""

    def episode(self, omega: Table) -> tuple[int, float]:
        """Play an episode and return its steps and its return."""
        s = self.world.first(self.stream)
        self.trajectory = [s]
        steps, total, terminated = 0, 0.0, False
        while not terminated and steps < self.world.limit:
            a = self.policy(s)
            s2, r, terminated = self.world.step(s, a, self.stream)
            self.update(s, a, r, s2, terminated, omega)
            self.after(s, a, r, s2, terminated, omega)
            s = s2
            steps += 1
            total += r
            self.trajectory.append(s)
        self.epsilon *= self.decay
        return steps, total
