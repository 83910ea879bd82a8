"""Team-Q line by line: Watkins' Q(lambda) on joint states and joint actions, each agent exploring on its own."""

from typing import Any

import numpy as np

from tests.reference.watkins_q_lambda import WatkinsQLambdaLearner


class TeamQLearner(WatkinsQLambdaLearner):
    """One team; `sizes` are its agents' numbers of actions."""

    def __init__(self, *args: Any, sizes: tuple[int, ...], **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.sizes = sizes

    def policy(self, state: int) -> int:
        """Each agent's part: its own, or that of one greedy joint action."""
        own: list[int | None] = []
        for agent in range(len(self.sizes)):
            explores = self.stream.uniform() < self.epsilon
            possible = self.parts_of(agent, state) if explores else []
            own.append(possible[self.stream.below(len(possible))] if explores else None)
        if None not in own:
            return int(np.ravel_multi_index([part for part in own if part is not None], self.sizes))
        value = self.value(state)
        best = [a for a in self.world.allowed(state) if self.q[state, a] == value]
        joint = self.stream.choice(best) if self.ties == "random" else best[0]
        shared = np.unravel_index(joint, self.sizes)
        parts = [int(shared[m]) if part is None else part for m, part in enumerate(own)]
        return int(np.ravel_multi_index(parts, self.sizes))

    def parts_of(self, agent: int, state: int) -> list[int]:
        """What an agent may do: its part of any joint action that may be taken."""
        allowed = self.world.allowed(state)
        return sorted({int(part) for part in np.unravel_index(allowed, self.sizes)[agent]})
