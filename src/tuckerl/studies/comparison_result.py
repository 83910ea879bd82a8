"""What came out of a comparison: the paired difference, the same against the control, and curves."""

from typing import Any, NamedTuple

import polars as pl

from tuckerl.adapters.joint import agents_of
from tuckerl.adapters.making import make_environment
from tuckerl.adapters.resolve import Agents
from tuckerl.studies.comparison import ComparisonStudy
from tuckerl.studies.environments import has_several_agents
from tuckerl.studies.estimates import Estimate, Reached
from tuckerl.studies.statistics import MEASURES, Difference, Measure, compare_with_control, json_numbers
from tuckerl.studies.study import Comparison, Variant
from tuckerl.studies.summary import Curve
from tuckerl.studies.tables import StudyTables
from tuckerl.studies.variants import why_no_control
from tuckerl.types import IntArray

VERDICTS = {"holds": "better", "does not hold": "worse", "not decided": "not decided"}


class Compared(NamedTuple):
    """A comparison of two variants of a scenario, and what came out."""

    comparison: Comparison
    base: Variant
    candidate: Variant
    difference: Difference  # of the candidate to the base
    control: Difference  # of the candidate to the control; nothing where there is none
    estimates: tuple[Estimate, ...]  # of the base, the candidate, the control

    @property
    def verdict(self) -> str:
        """Whether the candidate is "better", "worse" or it is "not decided"."""
        return VERDICTS[self.difference.verdict]

    @property
    def measure(self) -> Measure:
        """What is measured."""
        return MEASURES[self.comparison.measure]

    @property
    def no_control(self) -> str:
        """Why there is no control; "" where there is one."""
        return why_no_control(self.base, self.candidate)

    def to_dict(self) -> dict[str, Any]:
        """Return what came out, as files of numbers have it."""
        return {
            "base": self.comparison.base,
            "candidate": self.comparison.candidate,
            "measure": self.comparison.measure,
            "larger_is_better": self.measure.larger_is_better,
            "verdict": self.verdict,
            "relative": self.difference.relative,
            **json_numbers(self.difference, "difference", "low", "high"),
            "control": self.comparison.control or None,
            **json_numbers(self.control, "control_difference", "control_low", "control_high"),
            "no_control": self.no_control or None,
            "runs": self.difference.n_pairs,
            "diverged": self.difference.n_diverged,
        }


class ComparisonResult(NamedTuple):
    """A comparison and its result."""

    study: ComparisonStudy
    difference: Difference  # of the candidate to the base
    control: Difference  # of the candidate to the control; nothing where there is none
    estimates: tuple[Estimate, ...]  # in the order of the variants: base, candidate, control
    episode: IntArray  # (P,) the last one that each point of the curves stands for
    curves: tuple[Curve, ...]  # by points: the measured quantity in an episode
    regrets: tuple[Estimate, ...] = ()  # of what each variant had learned in the end, where it is known

    @property
    def compared(self) -> Compared:
        """What came out, apart from the study and the curves."""
        base, candidate = self.study.scenario.variants[:2]
        return Compared(self.study.comparison, base, candidate, self.difference, self.control, self.estimates)

    @property
    def measure(self) -> Measure:
        """What is measured."""
        return self.compared.measure

    @property
    def verdict(self) -> str:
        """Whether the candidate is "better", "worse" or it is "not decided"."""
        return self.compared.verdict

    def to_dict(self) -> dict[str, Any]:
        """Return the content of ``compare.json``."""
        config = self.study.config
        environment = {"environment": config.environment, "environment_keywords": dict(config.keywords)}
        numbers = {"episodes": config.n_episodes, "seed": config.seed, "equal_experience": config.equal_experience}
        regrets = {one.variant: json_numbers(one[1:4], "regret", "regret_low", "regret_high") for one in self.regrets}
        variants = [estimate.to_dict() | regrets.get(estimate.variant, {}) for estimate in self.estimates]
        return environment | self.compared.to_dict() | numbers | {"variants": variants}


def summarise_comparison(study: ComparisonStudy, tables: StudyTables) -> ComparisonResult:
    """Return what came out of a comparison's study."""
    config = study.config
    entropy = [config.seed, study.scenario.number]
    difference, control = compare_with_control(tables.runs, study.comparison, entropy)
    names = [variant.name for variant in study.scenario.variants]
    reached = Reached(tables, config.measure)
    estimates = tuple(reached.estimate(name) for name in names)
    curves = reached.learning_curves(names, config.n_episodes)
    regrets = tuple(one for one in map(reached.regret, names) if one is not None)
    return ComparisonResult(study, difference, control, estimates, *curves, regrets)


def means_by_agent(study: ComparisonStudy, tables: StudyTables) -> dict[str, dict[str, float]]:
    """Return each agent's mean return by the name of a variant, and by its own, where agents share a world.

    Variants of a joint table, and those whose agents all got the same, are left out.
    """
    config = study.config
    if not has_several_agents(config.environment):
        return {}
    env: Any = make_environment(config.environment, config.keywords)
    names = [str(agent) for agent in agents_of(env)]
    env.close()
    means: dict[str, dict[str, float]] = {}
    for variant in study.scenario.variants:
        runs = tables.runs.filter(pl.col("variant") == variant.name)
        by_agent = runs.group_by("agent").agg(pl.col("return").mean()).sort("agent")["return"].to_list()
        is_joint = variant.learner.reads_agents is Agents.JOINT
        if not is_joint and len(by_agent) == len(names) and len(set(by_agent)) > 1 and None not in by_agent:
            means[variant.name] = dict(zip(names, by_agent, strict=True))
    return means
