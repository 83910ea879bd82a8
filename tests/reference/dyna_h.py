"""Dyna-H line by line (Figures 6 and 7)."""

from typing import Any

from tests.reference.q_learning import QLearner, Table


class DynaHLearner(QLearner):
    """One agent with its model; `farthest` False is a deliberate fault for tests of the tests."""

    def __init__(
        self,
        *args: Any,
        heuristic: Table,
        planning_steps: int,
        search_control: str,
        farthest: bool = True,
        **kwargs: Any,
    ) -> None:
        super().__init__(*args, **kwargs)
        self.heuristic, self.planning_steps, self.search_control, self.farthest = (
            heuristic,
            planning_steps,
            search_control,
            farthest,
        )
        self.model: dict[tuple[int, int], tuple[int, float, bool]] = {}  # in the order in which pairs were first seen

    def observed_states(self) -> list[int]:
        return list(dict.fromkeys(s for s, _ in self.model))

    def modelled_actions(self, s: int) -> list[int]:
        return [a for a in range(self.world.n_actions) if (s, a) in self.model]

    def h_a(self, s: int) -> int | None:
        """The modelled action that leads farthest from the goal."""
        actions = self.modelled_actions(s)
        if not actions:
            return None
        distance = {a: self.heuristic[self.model[s, a][0]] for a in actions}
        extreme = max(distance.values()) if self.farthest else min(distance.values())
        return self.stream.choice([a for a in actions if distance[a] == extreme])

    def after(self, s: int, a: int, r: float, s2: int, terminated: bool, omega: Table) -> None:
        """Remember, then plan."""
        self.model[s, a] = (s2, r, terminated)
        now = s
        for _ in range(self.planning_steps):
            if self.search_control == "restart":
                now = s
            if self.search_control == "random":
                observed = self.observed_states()
                now = observed[self.stream.below(len(observed))]
            action = self.h_a(now)
            if action is None:
                observed = self.observed_states()
                now = observed[self.stream.below(len(observed))]
                actions = self.modelled_actions(now)
                action = actions[self.stream.below(len(actions))]
            planned, reward, ends = self.model[now, action]
            self.update(now, action, reward, planned, ends, omega)
            now = planned
