"""Tuning: batches of trials, halved in rungs of runs, and a test of the winner on fresh seeds.

Optuna proposes settings in batches of fixed size; what came of a batch is told in order, when all of it is known. Each
batch is played in *rungs*: all its trials play the first few runs, a third of them goes on to more. Nothing is decided
before all of a rung is finished, and batch k's sampler is made from child k of the seed: so neither the number of
workers nor a kill changes who wins. A rung is a scenario of the folder's study; all have the same seeds, so that the
runs of one rung are those of the next.
"""

import math
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
import polars as pl

from tuckerl.checks import check_int, check_name
from tuckerl.errors import MissingExtraError, ParameterError
from tuckerl.studies.algorithms import ALGORITHMS, Algorithm, named_algorithm
from tuckerl.studies.comparison import N_EPISODES, N_RUNS
from tuckerl.studies.search_space import Searched, SearchSpace, check_names
from tuckerl.studies.statistics import MEASURES, Pairs, pairs_by_variant
from tuckerl.studies.study import Comparison, Scenario, Study
from tuckerl.studies.study_file import seed_number
from tuckerl.studies.tables import StudyTables
from tuckerl.studies.variants import MadeVariant, NamedEnvironment, control_of, scenario_of

N_TRIALS, BATCH, RUNGS = 45, 9, (2, 6, 18)
MEASURED = ("return", "steps", "final")
_RUNG = ", runs: "
_GO_ON = 3  # one of so many goes on to the next rung

Play = Callable[[Study], StudyTables]
"""Plays what is missing of a study and returns its tables."""


def is_rung(scenario: str) -> bool:
    """Return whether a scenario of this name is a rung of a tuning."""
    return f": tuning{_RUNG}" in scenario


class TuningConfig(NamedTuple):
    """What is tuned and how long, as its user gives it."""

    algorithm: str
    environment: str  # an id
    keywords: Mapping[str, Any] = {}  # of the environment
    searched: Mapping[str, Searched] = {}  # beside the default ranges, or in their place
    settings: Mapping[str, Any] = {}  # what is fixed
    measure: str = "return"
    n_agents: int | None = None
    n_trials: int = N_TRIALS  # of each algorithm
    batch: int = BATCH
    rungs: tuple[int, ...] = RUNGS  # runs of a trial that has come so far
    n_runs: int = N_RUNS  # of the test
    n_episodes: int = N_EPISODES
    seed: int = 0


@dataclass
class Trial:
    """Settings that were tried, and the mean of what was measured by the number of runs; NaN where one diverged."""

    batch: int
    made: MadeVariant
    choices: dict[str, Any]
    proposed: Any  # Optuna's trial; None where nothing is searched
    means: dict[int, float] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """The variant's name."""
        return self.made.variant.name


class Search:
    """The search for one algorithm's settings."""

    def __init__(self, space: SearchSpace, config: TuningConfig) -> None:
        self.space, self.trials = space, list[Trial]()
        self._config = config
        self.larger_is_better = MEASURES[config.measure].larger_is_better
        self._sign = 1.0 if self.larger_is_better else -1.0
        optuna = _library()
        self._optuna, self._study = optuna, optuna.create_study(direction="maximize")

    def ask(self, batch: int) -> list[Trial]:
        """Return the trials of a batch."""
        config = self._config
        if not self.space.searched:  # there is one way to play it
            return [Trial(0, self.space.variant({}), {}, None)] if batch == 0 else []
        child = np.random.SeedSequence(config.seed, spawn_key=(batch,))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", self._optuna.exceptions.ExperimentalWarning)
            self._study.sampler = self._optuna.samplers.TPESampler(
                seed=int(child.generate_state(1)[0]), n_startup_trials=config.batch, constant_liar=True
            )
        asked = []
        for _ in range(min(config.batch, config.n_trials - batch * config.batch)):
            proposed = self._study.ask()
            choices = self.space.choose(proposed)
            asked.append(Trial(batch, self.space.variant(choices), choices, proposed))
        return asked

    def judge(self, trials: list[Trial], rung: int, pairs: Mapping[str, Pairs]) -> list[Trial]:
        """Note what trials reached in a rung, and return which of them go on: each settings once, the best first."""
        for trial in trials:
            own = pairs[trial.name]
            trial.means[rung] = math.nan if own.diverged.any() else float(own.value.mean())
        finite = {trial.name: trial for trial in reversed(trials) if not math.isnan(trial.means[rung])}
        ranked = sorted(finite.values(), key=lambda trial: (-self._sign * trial.means[rung], trials.index(trial)))
        return ranked[: math.ceil(len(trials) / _GO_ON)]

    def tell(self, trials: list[Trial]) -> None:
        """Tell Optuna what came of a batch, in order."""
        last = self._config.rungs[-1]
        for trial in trials:
            self.trials.append(trial)
            if trial.proposed is None:
                continue
            scores = {rung: self._sign * mean for rung, mean in trial.means.items() if not math.isnan(mean)}
            for rung, score in scores.items():
                trial.proposed.report(score, rung)
            if last in scores:
                self._study.tell(trial.proposed, scores[last])
            else:
                self._study.tell(trial.proposed, state=self._optuna.trial.TrialState.PRUNED)

    def winner(self) -> Trial:
        """Return the best of the trials that have played all rungs.

        Raises
        ------
        ParameterError
            If there is none.
        """
        last = self._config.rungs[-1]
        through = [trial for trial in self.trials if not math.isnan(trial.means.get(last, math.nan))]
        if not through:
            raise ParameterError(
                f"all trials of {self.space.algorithm.name} diverged: search smaller learning rates, such as --search "
                "alpha=0.001:0.1:log"
            )
        return max(through, key=lambda trial: self._sign * trial.means[last])  # the first of those that are equal


def _library() -> Any:
    try:
        import optuna
    except ImportError as error:
        raise MissingExtraError('tuning needs Optuna, which is not installed: pip install "tuckerl[tune]"') from error
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    return optuna


class Tuned(NamedTuple):
    """What a tuning came to: its whole study, of which the last scenario is the test."""

    study: Study
    searches: tuple[Search, ...]  # of the algorithm, and of its base where it has a tensor step

    @property
    def test(self) -> Scenario:
        """The test of the winner on fresh seeds."""
        return self.study.scenarios[-1]


class Tuning:
    """What a tuning will do; nothing of it is impossible.

    Parameters
    ----------
    config : TuningConfig

    Raises
    ------
    UnknownNameError, ParameterError, ParameterTypeError
        If a name is not known, a number, a setting or a range impossible, or nothing is left to search.
    ProblemError
        If the environment cannot be made, or the algorithm cannot play it.
    MissingExtraError
        If Optuna is not installed.
    """

    def __init__(self, config: TuningConfig) -> None:
        _library()
        algorithm = named_algorithm(config.algorithm)
        check_name("measure", config.measure, MEASURED)
        _check_numbers(config, algorithm)
        check_names((algorithm,), config.searched, config.settings)
        self.config, self.environment = config, NamedEnvironment(config.environment, config.keywords)
        base = [] if not algorithm.is_t_version else [base_of(algorithm)]
        self.spaces = [
            SearchSpace(one, self.environment, config.searched, config.settings, config.n_agents, config.n_episodes)
            for one in (algorithm, *base)
        ]
        if not self.spaces[0].searched:
            raise ParameterError(f"all that is searched of {algorithm.name} is set: leave something to --search")

    @property
    def most_runs(self) -> int:
        """The most runs that there can be: all trials in the last rung, and the test of three variants."""
        config = self.config
        return len(self.spaces) * config.n_trials * config.rungs[-1] + 3 * config.n_runs

    def search(self, play: Play) -> Tuned:
        """Search with `play`, and return the winner's test, which is not played yet."""
        searches = tuple(Search(space, self.config) for space in self.spaces)
        rungs: dict[int, dict[str, MadeVariant]] = {rung: {} for rung in self.config.rungs}
        for batch in range(math.ceil(self.config.n_trials / self.config.batch)):
            asked = [search.ask(batch) for search in searches]
            going = asked
            for rung, variants in rungs.items():
                variants |= {trial.name: trial.made for trials in going for trial in trials}
                study = self._study(rungs)
                pairs = self._pairs(play(study), rung)
                going = [search.judge(own, rung, pairs) for search, own in zip(searches, going, strict=True)]
            for search, own in zip(searches, asked, strict=True):
                search.tell(own)
        study = self._study(rungs)
        return Tuned(replace(study, scenarios=(*study.scenarios, self._test(searches))), searches)

    def _study(self, rungs: Mapping[int, Mapping[str, MadeVariant]]) -> Study:
        played = {rung: list(made.values()) for rung, made in rungs.items() if made}
        return Study(tuple(self._scenario("tuning", rung, made) for rung, made in played.items()), self.config.seed)

    def _name(self, what: str, rung: int) -> str:
        return f"{self.environment.label}: {what}" + (f"{_RUNG}{rung}" if what == "tuning" else "")

    def _scenario(
        self,
        what: str,
        n_runs: int,
        variants: list[MadeVariant],
        controls: tuple[Any, ...] = (),
        comparisons: tuple[Comparison, ...] = (),
    ) -> Scenario:
        name = self._name(what, n_runs)
        return scenario_of(
            self.environment,
            variants,
            list(controls),
            comparisons,
            name=name,
            title=name,
            number=seed_number(f"{self.environment.label}: {what}"),  # the rungs' is one
            n_runs=n_runs,
            n_episodes=self.config.n_episodes,
            measure=self.config.measure,
        )

    def _pairs(self, tables: StudyTables, rung: int) -> dict[str, Pairs]:
        own = tables.runs.filter(pl.col("scenario") == self._name("tuning", rung))
        return pairs_by_variant(own, MEASURES[self.config.measure])

    def _test(self, searches: tuple[Search, ...]) -> Scenario:
        candidate = searches[0].winner().made
        if len(searches) > 1:
            base = searches[1].winner().made
        else:
            base = self.spaces[0].variant({}).named(f"{self.config.algorithm}-default")
        control = control_of(base, candidate)
        controls = () if control is None else (replace(control, name=f"{candidate.variant.name}-constant"),)
        names = base.variant.name, candidate.variant.name, controls[0].name if controls else ""
        claim = f"{names[1]} does better than {names[0]}"
        compared = Comparison("", claim, self.config.measure, *names)
        return self._scenario("test", self.config.n_runs, [base, candidate], controls, (compared,))


def base_of(algorithm: Algorithm) -> Algorithm:
    """Return the unmodified algorithm of a T-version."""
    return next(one for one in ALGORITHMS.values() if one.learner is algorithm.learner and not one.is_t_version)


def _check_numbers(config: TuningConfig, algorithm: Algorithm) -> None:
    for name, number in (("trials", config.n_trials), ("batch", config.batch), ("runs", config.n_runs)):
        check_int(name, number, 1)
    check_int("episodes", config.n_episodes, 1)
    check_int("seed", config.seed, 0)
    for rung in config.rungs:
        check_int("rungs", rung, 1)
    if not config.rungs or list(config.rungs) != sorted(set(config.rungs)):
        got = ",".join(map(str, config.rungs))
        raise ParameterError(f"rungs must be numbers of runs, each larger than the one before; got {got or 'none'}")
    if config.n_agents is not None:
        check_int("agents", config.n_agents, 1)
        if not algorithm.is_t_version:
            raise ParameterError(f"agents are those of a T-version, and {algorithm.name} is none: leave --agents out")
