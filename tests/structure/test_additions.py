"""Proof by addition: what the library is open for is one new file and one line in a register.

The new files lie in ``additions/``. They are put into a copy of the package, with their lines in its registers, and
tests use that copy in processes of their own. Nothing else of the copy differs from the package.
"""

import difflib
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pytest

import tuckerl

pytestmark = pytest.mark.slow

PACKAGE = Path(tuckerl.__file__).parent
NEW_FILES = Path(__file__).parent / "additions"


class Addition(NamedTuple):
    """A new file, where it goes, and its line."""

    file: str
    folder: str
    register: str  # the file that has the register
    opening: str  # the line after which the new one is written
    line: str


ADDITIONS = {
    "clipped double Q-learning": Addition(
        "clipped_double_q.py",
        "learners",
        "learners/__init__.py",
        "LEARNERS = (",
        '    LearnerEntry("ClippedDoubleQ", "tuckerl.learners.clipped_double_q", "Clipped double Q", "Fujimoto"),',
    ),
    "soft SARSA": Addition(
        "soft_sarsa.py",
        "learners",
        "learners/__init__.py",
        "LEARNERS = (",
        '    LearnerEntry("SoftSarsa", "tuckerl.learners.soft_sarsa", "Soft SARSA", "Haarnoja et al. 2018"),',
    ),
    "WoLF-PHC": Addition(
        "wolf_phc.py",
        "learners",
        "learners/__init__.py",
        "LEARNERS = (",
        '    LearnerEntry("WolfPhc", "tuckerl.learners.wolf_phc", "WoLF-PHC", "Bowling and Veloso 2002"),',
    ),
    "max-Boltzmann": Addition(
        "max_boltzmann.py",
        "training/policies",
        "training/policies/__init__.py",
        "POLICIES = {",
        '    "MaxBoltzmann": PolicyEntry(f"{__name__}.max_boltzmann", "softmax now and then"),',
    ),
    "a weighting": Addition(
        "squared.py",
        "generalization",
        "generalization/weights.py",
        "WEIGHTINGS = {",
        '    "squared": Weighting("tuckerl.generalization.squared:weigh", True, "the square of its weight"),',
    ),
    "a sharing rule": Addition(
        "latest_best.py",
        "generalization",
        "generalization/sharing.py",
        "SHARING_RULES = {",
        '    "latest": SharingRule("tuckerl.generalization.latest_best:mix", False, "the latest best table"),',
    ),
    "a scenario": Addition(
        "lake.py", "studies", "studies/scenarios.py", "_LISTED = (", '    "tuckerl.studies.lake:LAKE",'
    ),
    "a figure": Addition(
        "run_bars.py", "reports", "reports/figures.py", "_LISTED = (", '    "tuckerl.reports.run_bars:RUN_BARS",'
    ),
    "a kind of problem": Addition(
        "lottery.py",
        "problems",
        "adapters/kinds.py",
        "PROBLEM_KINDS: dict[str, ProblemKind] = {",
        '    "lottery": ProblemKind("tuckerl.problems.lottery:Lottery", "actions that pay by chance"),',
    ),
}

Run = Callable[..., str]


@pytest.fixture(scope="session")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the package in which everything has been added."""
    package = tmp_path_factory.mktemp("additions") / "tuckerl"
    shutil.copytree(PACKAGE, package, ignore=shutil.ignore_patterns("__pycache__"))
    for addition in ADDITIONS.values():
        shutil.copy(NEW_FILES / addition.file, package / addition.folder)
        register = package / addition.register
        before, opening, after = register.read_text(encoding="utf-8").partition(f"\n{addition.opening}\n")
        assert opening, f"{addition.register} has no line {addition.opening!r}"
        register.write_text(f"{before}{opening}{addition.line}\n{after}", encoding="utf-8")
    return package


@pytest.fixture
def run(copy: Path, tmp_path: Path, pytestconfig: pytest.Config) -> Run:
    """Run Python with the copy in the place of the package, its kernels kept from one test run to the next."""
    kernels = pytestconfig.cache.mkdir("kernels-of-additions")
    environment = os.environ | {"PYTHONPATH": str(copy.parent), "NUMBA_CACHE_DIR": str(kernels)}

    def run(*arguments: str) -> str:
        done = subprocess.run(
            [sys.executable, *arguments], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    return run


def test_each_takes_one_line_outside_of_its_file(copy: Path) -> None:
    added: dict[str, list[str]] = {}
    theirs = {path.relative_to(copy) for path in copy.rglob("*") if path.is_file()}
    ours = {
        path.relative_to(PACKAGE) for path in PACKAGE.rglob("*") if path.is_file() and "__pycache__" not in path.parts
    }
    assert theirs - ours == {Path(one.folder) / one.file for one in ADDITIONS.values()}
    assert ours <= theirs
    for path in ours:
        if (copy / path).read_bytes() != (PACKAGE / path).read_bytes():
            before, after = ((root / path).read_text(encoding="utf-8").splitlines() for root in (PACKAGE, copy))
            changes = [line for line in difflib.ndiff(before, after) if line[0] in "+-"]
            assert all(line.startswith("+ ") for line in changes), "a line of the package itself has changed"
            added[path.as_posix()] = sorted(line[2:] for line in changes)
    assert added == {
        register: sorted(one.line for one in ADDITIONS.values() if one.register == register)
        for register in {one.register for one in ADDITIONS.values()}
    }


@pytest.mark.long  # a page's example runs them in every run of the tests, for one of these
@pytest.mark.parametrize("learner", ["ClippedDoubleQ", "SoftSarsa", "WolfPhc"])
def test_a_learner_passes_the_checks(learner: str, run: Run) -> None:
    run("-c", f"import tuckerl; tuckerl.testing.check_learner(tuckerl.{learner})")


def test_commands_know_the_learners_and_their_t_versions(run: Run) -> None:
    listed = {line.split("\t")[0] for line in run("-m", "tuckerl", "list", "algorithms").splitlines()}
    names = ("clipped-double-q", "soft-sarsa", "wolf-phc")
    assert {*names, *(f"t-{name}" for name in names)} <= listed
    options = ("--episodes", "20", "--evaluate", "2", "--out", "kept")
    run("-m", "tuckerl", "train", "t-clipped-double-q", "FrozenLake-v1", *options)
    played = run("-m", "tuckerl", "evaluate", "kept/agent.tuckerl")
    assert "ClippedDoubleQ with a tensor step on FrozenLake-v1" in played


WOLF = """
import numpy as np, tuckerl
reset = lambda parameters, state, rng: None
tables = dict(next_state=[[0, 0]], reward=[[1.0, 1.0]], terminated=[[True, True]])
agent = tuckerl.WolfPhc(tuckerl.TabularMDP(**tables), seed=0, delta_win=tuckerl.Linear(0.1, 0.01, 50)).learn(3)
pi = agent.declared[0]["distribution"]
pi[0] = [0.25, 0.75]
drawn = [agent.predict(0)[0] for _ in range(2000)]
assert 0.7 < np.mean(drawn) < 0.8, np.mean(drawn)
assert agent.predict(0, deterministic=True)[0] == 1
q = agent.q[0, 0]
assert agent.predict(np.zeros(5, dtype=int), deterministic=True)[0].tolist() == [1] * 5
payoffs = tuckerl.TabularMDP(next_state=[[0, 0]], reward=[[0.0, 1.0]], terminated=[[True, True]])
again = tuckerl.WolfPhc(payoffs, seed=0).learn(200)
assert again.declared[0]["distribution"][0, 1] > 0.9
assert again.evaluate(500).mean > 0.9
again.declared[0]["distribution"][0] = [0.5, 0.5]
assert 0.4 < again.evaluate(2000).mean < 0.6, "evaluate plays the distribution, not the best value"
"""


def test_a_distribution_that_is_learned_is_what_is_played(run: Run) -> None:
    run("-c", WOLF)


MAX_BOLTZMANN = """
import numpy as np, tuckerl
for kind in (tuckerl.SarsaLambda, tuckerl.SoftSarsa):
    agent = kind("FrozenLake-v1", policy=tuckerl.MaxBoltzmann(0.5, tuckerl.Linear(1.0, 0.1, 50)), seed=0)
    agent.learn(60).save("agent.tuckerl")
    again = tuckerl.load("agent.tuckerl")
    assert repr(again.policy.temperature) == repr(tuckerl.Linear(1.0, 0.1, 50))
    np.testing.assert_array_equal(agent.learn(5).q, again.learn(5).q)
    np.testing.assert_allclose(agent.scheduled("temperature")[[0, 50, 64]], [1.0, 0.1, 0.1])
values = np.log(np.tile([1, 2, 3, 4.0], (16, 1)))
mixed = tuckerl.QLearning("FrozenLake-v1", policy=tuckerl.MaxBoltzmann(0.5, 1.0), seed=0, initial_q=values)
counts = np.bincount(mixed.predict(np.zeros(20000, dtype=int), deterministic=False)[0], minlength=4) / 20000
np.testing.assert_allclose(counts, [0.05, 0.1, 0.15, 0.7], atol=0.02)
"""


@pytest.mark.long
def test_a_policy_serves_every_learner(run: Run) -> None:
    run("-c", MAX_BOLTZMANN)


STEP = """
import numpy as np, tuckerl
step = tuckerl.TensorStep(every=5, ranks=(8, 3, 5, 2), weights="squared", share="latest", floor=0.01)
agent = tuckerl.QLearning("FrozenLake-v1", n_agents=3, tensor_step=step, seed=0, initial_q=0.5).learn(10)
plain = tuckerl.TensorStep(every=5, ranks=(8, 3, 5, 2))
paper = tuckerl.QLearning("FrozenLake-v1", n_agents=3, tensor_step=plain, seed=0, initial_q=0.5).learn(5)
np.testing.assert_allclose(agent.tensor_step_history.weights[0], np.maximum(np.square(paper.action_weights), 0.01))
assert agent.tensor_step_history.chosen[0] == np.argmax(agent.returns[4])
"""


def test_a_weighting_and_a_sharing_rule_work_by_name(run: Run) -> None:
    run("-c", STEP)
    assert "squared\tthe square of its weight\n" in run("-m", "tuckerl", "list", "weights")
    assert "latest\tthe latest best table\n" in run("-m", "tuckerl", "list", "shares")


PAPER = """
import json
from tuckerl.studies.ablation import ablation_study
from tuckerl.studies.scenarios import SCENARIOS
from tuckerl.studies.sensitivity import sensitivity_study
from tuckerl.studies.study import Study
paper = Study(tuple(SCENARIOS[name] for name in ("cart-pole", "dyna-maze", "robot-rescue")), 0)
studies = (paper, ablation_study(paper), sensitivity_study(paper))
print(json.dumps([study.specification() for study in studies], sort_keys=True))
"""


def test_additions_change_nothing_in_the_papers_run(run: Run, tmp_path: Path) -> None:
    ours = subprocess.run([sys.executable, "-c", PAPER], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert run("-c", PAPER) == ours.stdout


def test_a_scenario_and_a_figure_are_in_the_report(run: Run, tmp_path: Path) -> None:
    told = run("-m", "tuckerl", "reproduce", "lake", "--runs", "2", "--workers", "1", "--sensitivity", "--out", "lake")
    assert " L1  " in told
    figures = {path.stem for path in (tmp_path / "lake" / "figures").glob("*.svg")}
    assert figures == {"ablation-lake", "curves-lake", "omega-lake", "runs-lake", "sensitivity"}
    page = (tmp_path / "lake" / "report.html").read_text(encoding="utf-8")
    assert "In how many runs no table diverged." in page
    assert "lake\tQ-learning crosses a frozen lake" in run("-m", "tuckerl", "list", "scenarios")


LOTTERY = """
import numpy as np, tuckerl
from tuckerl.problems.lottery import Lottery
from tuckerl.reports.inspect.learner import inspect_learner
learner = tuckerl.QLearning(Lottery([0.1, 0.9]), seed=0, n_agents=2).learn(50)
assert learner.steps.tolist() == [[5, 5]] * 50
assert learner.predict(0)[0] == 1
assert 0.5 < learner.evaluate(50).mean / 5 <= 1
learner.save("agent.tuckerl")
again = tuckerl.load("agent.tuckerl")
np.testing.assert_array_equal(again.learn(5).q, learner.learn(5).q)
print(learner.problem.describe(), list(inspect_learner(learner).action_names))
"""


def test_a_kind_of_problem_is_played_saved_and_described(run: Run) -> None:
    assert run("-c", LOTTERY) == "its lottery (1 state, 2 actions) is played in compiled code ['0', '1']\n"
