"""A scenario as a user writes one: Q-learning on the frozen lake, measured by return, with nothing said of figures."""

import polars as pl

from tuckerl.generalization.step import TensorStep
from tuckerl.learners.q_learning import QLearning
from tuckerl.studies.assumptions import INVENTED, Assumption
from tuckerl.studies.study import AlgorithmConfig, Alternative, Comparison, Scenario, variants

MEAN_RETURN, BEST_RETURN = pl.col("return").mean(), pl.col("return").max()

ALGORITHM = AlgorithmConfig(
    base="q-learning",
    t_version="tq-learning",
    learner=QLearning,
    parameters={"alpha": 0.2, "gamma": 0.95, "epsilon": 0.2},
    step=TensorStep(every=10, ranks=(8, 3, 9, 1), share="best"),
    n_actions=4,
)


def problem(instance: int) -> str:
    """Return the one lake there is."""
    return "FrozenLake-v1"


FROZEN_LAKE = Scenario(
    name="lake",
    title="Slippery lake",
    description="Q-learning crosses a frozen lake",
    number=4,
    problem=problem,
    n_instances=1,
    n_runs=10,
    n_episodes=40,
    algorithm=ALGORITHM,
    variants=variants(ALGORITHM, "q-learning", "tq-learning-1", "tq-learning-3", "constant-1", "constant-3-best"),
    measure="return",
    comparisons=(
        Comparison("L1", "the tensor step helps", "return", "q-learning", "tq-learning-1", "constant-1"),
        Comparison("L2", "agents help each other", "final", "tq-learning-1", "tq-learning-3", "constant-3-best"),
    ),
    assumptions=(Assumption(INVENTED, "The ice is slippery."),),
    shares=("best",),
    alternatives=(Alternative("smaller rate", {"alpha": 0.1}),),
)
