"""The learners, one file for each algorithm. To add one, write its file and list it in `LEARNERS`."""

import re
from typing import TYPE_CHECKING, NamedTuple

from tuckerl.registers import load

if TYPE_CHECKING:
    from tuckerl.training.learner import Learner


class TVersion(NamedTuple):
    """A learner with a tensor step, by the name that the paper or this library gives it."""

    name: str  # on the command line
    title: str
    source: str
    share: str  # the sharing rule by default


class LearnerEntry(NamedTuple):
    """A learner in the register."""

    class_name: str
    home: str
    title: str
    source: str
    paper_t_version: TVersion | None = None
    has_t_version: bool = True

    @property
    def name(self) -> str:
        """What commands call it: "double-q-learning" for the class DoubleQLearning."""
        return re.sub(r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "-", self.class_name).lower()

    @property
    def t_version(self) -> TVersion | None:
        """Its version with a tensor step; "t-" and its name where the paper has no name of its own for it."""
        if self.paper_t_version is not None or not self.has_t_version:
            return self.paper_t_version
        return TVersion(f"t-{self.name}", f"T-{self.title}", f"{self.source}, with the paper's tensor step", "max")

    def load(self) -> "type[Learner]":
        """Return the class."""
        kind: type[Learner] = load(f"{self.home}:{self.class_name}")
        return kind


_PAPER = "the paper's Figure"
LEARNERS = (
    LearnerEntry(
        "QLearning",
        "tuckerl.learners.q_learning",
        "Q-learning",
        f"Watkins and Dayan 1992; {_PAPER} 1",
        TVersion("tq-learning", "TQ-learning", f"{_PAPER} 5", "max"),
    ),
    LearnerEntry("Sarsa", "tuckerl.learners.sarsa", "SARSA", "Rummery and Niranjan 1994", has_t_version=False),
    LearnerEntry(
        "SarsaLambda",
        "tuckerl.learners.sarsa_lambda",
        "SARSA(λ)",
        f"Rummery and Niranjan 1994; {_PAPER} 2",
        TVersion("tsarsa-lambda", "TSARSA(λ)", f"{_PAPER} 8", "min"),
    ),
    LearnerEntry(
        "WatkinsQLambda",
        "tuckerl.learners.watkins_q_lambda",
        "Watkins' Q(λ)",
        "Watkins 1989; Sutton and Barto 2018, section 12.10",
    ),
    LearnerEntry(
        "TrueOnlineSarsaLambda",
        "tuckerl.learners.true_online_sarsa_lambda",
        "True online SARSA(λ)",
        "van Seijen et al. 2016; Sutton and Barto 2018, section 12.7",
    ),
    LearnerEntry(
        "RLearning",
        "tuckerl.learners.r_learning",
        "R-learning",
        "Schwartz 1993; Mahadevan 1996; Sutton and Barto 1998, section 6.7",
    ),
    LearnerEntry("HAQL", "tuckerl.learners.haql", "HAQL", "Bianchi, Ribeiro and Costa 2004, 2008"),
    LearnerEntry(
        "DynaH",
        "tuckerl.learners.dyna_h",
        "DYNA-H",
        f"Santos, Martin H. and Lopez 2011; {_PAPER} 6",
        TVersion("dyna-ht", "DYNA-HT", f"{_PAPER} 7", "max"),
    ),
    LearnerEntry("DynaQ", "tuckerl.learners.dyna_q", "Dyna-Q", "Sutton 1990; Sutton and Barto 2018, section 8.2"),
    LearnerEntry(
        "DynaQPlus", "tuckerl.learners.dyna_q_plus", "Dyna-Q+", "Sutton 1990; Sutton and Barto 2018, section 8.3"
    ),
    LearnerEntry(
        "PrioritizedSweeping",
        "tuckerl.learners.prioritized_sweeping",
        "Prioritized sweeping",
        "Moore and Atkeson 1993; Peng and Williams 1993; Sutton and Barto 2018, section 8.4",
    ),
    LearnerEntry("RMax", "tuckerl.learners.r_max", "R-max", "Brafman and Tennenholtz 2002", has_t_version=False),
    LearnerEntry(
        "TeamQ",
        "tuckerl.learners.team_q",
        "Team-Q",
        "Littman 2001, with Watkins' Q(λ) 1989; the paper's section IV.C",
        TVersion("team-tq", "Team-TQ", "the paper's section IV.C", "max"),
    ),
    LearnerEntry(
        "ExpectedSarsa",
        "tuckerl.learners.expected_sarsa",
        "Expected SARSA",
        "van Seijen et al. 2009; Sutton and Barto 6.6",
    ),
    LearnerEntry("DoubleQLearning", "tuckerl.learners.double_q_learning", "Double Q-learning", "van Hasselt 2010"),
    LearnerEntry("NStepSarsa", "tuckerl.learners.n_step_sarsa", "n-step SARSA", "Sutton and Barto 2018, section 7.2"),
    LearnerEntry("TreeBackup", "tuckerl.learners.tree_backup", "Tree backup", "Precup, Sutton and Singh 2000"),
    LearnerEntry(
        "MonteCarlo", "tuckerl.learners.monte_carlo", "Monte Carlo", "Sutton and Barto 2018, sections 5.3-5.4"
    ),
)
"""All learners, in the order in which they are listed."""
