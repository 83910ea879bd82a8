"""What a case is, and the worlds and learners that most of them are made of."""

import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmarks.versions.names import Arrays, made, recorded


class Folders(NamedTuple):
    """Where cases find files."""

    own: Path  # what this version saves
    old: Path  # what the old version saved
    kept: Path  # files of the formats there ever were, saved long ago


class Case(NamedTuple):
    """Something that both versions do, and must do alike."""

    name: str
    record: Callable[[Folders], Arrays]


@dataclass(frozen=True)
class World:
    """A problem, how long to play it, and what learners need to be told about it.

    Parameters
    ----------
    make : callable
        Returns what a learner takes as `env`.
    episodes : int
    parameters : mapping
        What every learner on it takes, such as bins.
    look : callable, optional
        From a learner and whether it is greedy to its actions; by default those in all states.
    has_heuristic : bool
        Whether Dyna-H finds one.
    """

    make: Callable[[], Any]
    episodes: int
    parameters: Mapping[str, Any] = field(default_factory=dict)
    look: Callable[[Any, bool], np.ndarray] | None = None
    has_heuristic: bool = False

    def learner(self, kind: str, name: str, **parameters: Any) -> Any:
        """Return a new learner, seeded by the name of its case."""
        chosen = {"seed": zlib.crc32(name.encode()), **self.parameters, **parameters}
        if kind == "DynaH" and not self.has_heuristic:
            n_states = made("QLearning", self.make(), **self.parameters).q.shape[1]
            chosen["heuristic"] = np.arange(n_states) * 7.0 % 5.0
        return made(kind, self.make(), **chosen)

    def actions(self, learner: Any) -> Arrays:
        """Return what a learner does greedily (what it draws with exploration is random, and versions may differ)."""
        look = _in_all_states if self.look is None else self.look
        return {"greedy actions": look(learner, True)}


def _in_all_states(learner: Any, greedy: bool) -> np.ndarray:
    actions: np.ndarray = learner.predict(np.arange(learner.q.shape[1]), deterministic=greedy)[0]
    return actions


VARIANTS: dict[str, tuple[str, dict[str, Any]]] = {
    "Q-learning": ("QLearning", {}),
    "SARSA": ("Sarsa", {}),
    "SARSA(0.9)": ("SarsaLambda", {"lambda_": 0.9}),
    "SARSA(0)": ("SarsaLambda", {"lambda_": 0.0}),
    "SARSA(lambda), accumulating": ("SarsaLambda", {"trace": "accumulating", "alpha": 0.05}),
    "SARSA(lambda), carried": ("SarsaLambda", {"carry_trace": True}),
    "SARSA(lambda), accumulating, carried": ("SarsaLambda", {"trace": "accumulating", "carry_trace": True}),
    "Dyna-H, trajectory": ("DynaH", {"search_control": "trajectory"}),
    "Dyna-H, restart": ("DynaH", {"search_control": "restart", "planning_steps": 5}),
    "Dyna-H, random": ("DynaH", {"search_control": "random"}),
    "Team-Q, independent": ("TeamQ", {"exploration": "independent", "cut_traces": False, "epsilon": 0.3}),
    "Team-Q, independent, cut": ("TeamQ", {"exploration": "independent", "cut_traces": True, "epsilon": 0.3}),
    "Team-Q, joint": ("TeamQ", {"exploration": "joint", "cut_traces": False, "trace": "accumulating"}),
    "Team-Q, joint, cut": ("TeamQ", {"exploration": "joint", "cut_traces": True, "carry_trace": True}),
}
"""Every learner, with all that it knows to do in more than one way."""


def learning(name: str, world: World, kind: str, parameters: Mapping[str, Any], *, shown: bool = False) -> Case:
    """Return the case of a learner that learns in two parts; if `shown`, it is asked and evaluated as well."""

    def record(_: Folders) -> Arrays:
        learner = world.learner(kind, name, **parameters)
        first = max(1, world.episodes // 3)
        learner.learn(first).learn(max(1, world.episodes - first))
        arrays = recorded(learner)
        return arrays | world.actions(learner) | evaluated(learner) if shown else arrays

    return Case(name, record)


def evaluated(learner: Any, episodes: int = 10, **seed: int) -> Arrays:
    """Return what greedy episodes are like."""
    result = learner.evaluate(episodes, **seed)
    parts = ("returns", "steps", "mean", "low", "high")
    return {f"evaluation, {part}": np.asarray(getattr(result, part)) for part in parts}


def named(prefix: str, arrays: Mapping[str, np.ndarray]) -> Arrays:
    """Return arrays under names that begin with `prefix`."""
    return {f"{prefix}, {name}": array for name, array in arrays.items()}
