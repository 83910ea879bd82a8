"""A study as data: which variants of an algorithm play which scenarios, how often, from which seed.

A *scenario* has a problem for each of its *instances* (the maze's number), a list of *variants* and the claims that are
tested on it. A run is a pure function of the study and its (scenario, variant, instance, run), so nothing else, the
number of workers least of all, can change a result.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from tuckerl.adapters.resolve import Environment
from tuckerl.checks import check_int
from tuckerl.errors import UnknownNameError
from tuckerl.generalization.sharing import SHARING_RULES
from tuckerl.generalization.step import TensorStep
from tuckerl.generalization.weights import WEIGHTINGS
from tuckerl.training.learner import Learner


@dataclass(frozen=True)
class AlgorithmConfig:
    """An algorithm of the paper and its T-version: what all variants of a scenario have in common."""

    base: str  # as on the command line: "dyna-h"
    t_version: str  # "dyna-ht"
    learner: type[Learner]
    parameters: Mapping[str, Any]
    step: TensorStep  # of the T-version, with the paper's share
    n_actions: int


@dataclass(frozen=True)
class Variant:
    """One learner of a study."""

    name: str
    learner: type[Learner]
    parameters: Mapping[str, Any]
    n_agents: int
    tensor_step: TensorStep | None

    def make(self, env: Environment, seed: np.random.SeedSequence) -> Learner:
        """Return the learner, ready to learn."""
        return self.learner(env, **self.parameters, n_agents=self.n_agents, tensor_step=self.tensor_step, seed=seed)

    def specification(self) -> dict[str, Any]:
        """Return all that decides what it does, as JSON."""
        step = self.tensor_step
        return {
            "learner": self.learner.__name__,
            "parameters": dict(self.parameters),
            "n_agents": self.n_agents,
            "tensor_step": None if step is None else {**vars(step), "ranks": list(step.ranks)},
        }


def variant(family: AlgorithmConfig, name: str) -> Variant:
    """Return the variant of a family that `name` stands for.

    ``<base>``; ``<t-version>-<n>`` for n agents with the paper's share and ``<t-version>-<n>-<share>`` with another;
    ``<weights>-<n>`` for other weights without sharing and ``<weights>-<n>-<share>`` with it.

    Raises
    ------
    UnknownNameError
        If `name` follows none of these.
    """
    if name == family.base:
        return Variant(name, family.learner, family.parameters, 1, None)
    match = re.fullmatch(r"(?P<kind>.+?)-(?P<n>[1-9]\d*)(?:-(?P<share>[a-z]+))?", name)
    kind = match["kind"] if match else ""
    if match is None or kind not in (family.t_version, *WEIGHTINGS) or match["share"] not in (None, *SHARING_RULES):
        raise UnknownNameError(
            f"unknown variant {name!r}: expected {family.base}, {family.t_version}-<agents>[-<share>] or "
            f"<weights>-<agents>[-<share>] with weights {', '.join(WEIGHTINGS)} and share {', '.join(SHARING_RULES)}"
        )
    if kind == family.t_version:
        step = replace(family.step, share=match["share"] or family.step.share)
    else:
        step = replace(family.step, weights=kind, share=match["share"] or "none")
    return Variant(name, family.learner, family.parameters, int(match["n"]), step)


@dataclass(frozen=True)
class Comparison:
    """A claim that one variant does better than another, with the control that has its learning rate only."""

    id: str
    claim: str
    measure: str  # a name in statistics.MEASURES
    base: str
    candidate: str
    control: str


class Assumption(NamedTuple):
    """What the paper leaves open and how this study reads it."""

    mark: str  # INVENTED, INFERRED or OVERRULED
    text: str


INVENTED, INFERRED, OVERRULED = "D", "I", "P!"
"""Ours; inferred from the paper; printed in the paper and overruled by a public source behind the scenario."""

SHARED_ASSUMPTIONS = (
    Assumption(INFERRED, "One pass of the paper's inner loop is one whole episode of one agent."),
    Assumption(
        INFERRED,
        "The tables are factorised after every tenth episode, once all agents have finished it (Figure 7 prints it "
        "inside "
        "the loop over agents: taken as a misprint).",
    ),
    Assumption(
        INVENTED,
        "The decomposition is Tucker3 by alternating least squares, stopped when the fit changes by less than 1e-4, "
        "started "
        "from the truncated HOSVD where the paper's toolbox starts at random.",
    ),
    Assumption(
        INVENTED,
        "Ranks above what a window allows are clipped; a window of zeros changes nothing; a run that leaves the finite "
        "numbers is marked diverged in that episode and left out of comparisons.",
    ),
    Assumption(INVENTED, "Ties between agents go to the lowest index; an action whose weight is 0 stays at 0."),
    Assumption(
        INVENTED, "Tables begin at zero. Nothing is bootstrapped from a terminal state, and all from a truncated one."
    ),
)


@dataclass(frozen=True)
class Scenario:
    """A problem, or several, and what is compared on it."""

    name: str
    title: str
    number: int  # its place in the seeds
    problem: Callable[[int], Environment]  # from an instance's number
    n_instances: int
    n_runs: int
    n_episodes: int
    variants: tuple[Variant, ...]
    comparisons: tuple[Comparison, ...]
    record_paths_of: tuple[str, ...]  # variants whose best paths in run 0 of instance 0 are kept
    family: AlgorithmConfig
    measure: str  # what its figure shows: a name in statistics.MEASURES
    assumptions: tuple[Assumption, ...]
    environment: Mapping[str, Any] = field(default_factory=dict)  # as JSON, where the scenario's name does not tell it

    def specification(self) -> dict[str, Any]:
        """Return all that decides the scenario's results, as JSON."""
        environment = {"environment": dict(self.environment)} if self.environment else {}
        return environment | {
            "instances": self.n_instances,
            "runs": self.n_runs,
            "episodes": self.n_episodes,
            "variants": {variant.name: variant.specification() for variant in self.variants},
        }

    def resized(
        self, n_instances: int | None = None, n_runs: int | None = None, n_episodes: int | None = None
    ) -> "Scenario":
        """Return the scenario with other numbers where they are given.

        Raises
        ------
        ParameterError, ParameterTypeError
            If a number is not a whole number of at least 1.
        """
        return replace(
            self,
            n_instances=self.n_instances if n_instances is None else check_int("instances", n_instances, 1),
            n_runs=self.n_runs if n_runs is None else check_int("runs", n_runs, 1),
            n_episodes=self.n_episodes if n_episodes is None else check_int("episodes", n_episodes, 1),
        )


@dataclass(frozen=True)
class Study:
    """Scenarios and the seed of all their runs."""

    scenarios: tuple[Scenario, ...]
    seed: int

    def specification(self) -> dict[str, Any]:
        """Return all that decides the study's results, as JSON (versions of code aside)."""
        return {
            "seed": self.seed,
            "scenarios": {scenario.name: scenario.specification() for scenario in self.scenarios},
        }

    def run_seed(self, scenario: Scenario, instance: int, run: int) -> np.random.SeedSequence:
        """Return the seed of a run: equal for all variants, which pairs them."""
        return np.random.SeedSequence(self.seed, spawn_key=(scenario.number, instance, run))
