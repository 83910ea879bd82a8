"""A scenario of a user's own, measured by return: Q-learning on the frozen lake, with nothing said of figures."""

from tuckerl.generalization.tensor_step import TensorStep
from tuckerl.learners.q_learning import QLearning
from tuckerl.studies.study import AlgorithmConfig, Alternative, Comparison, Scenario, variants

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


LAKE = Scenario(
    name="lake",
    title="Slippery lake",
    description="Q-learning crosses a frozen lake",
    number=4,
    problem=problem,
    n_instances=1,
    n_runs=4,
    n_episodes=30,
    algorithm=ALGORITHM,
    variants=variants(ALGORITHM, "q-learning", "tq-learning-1", "tq-learning-3", "constant-1", "constant-3-best"),
    measure="return",
    comparisons=(Comparison("L1", "the step helps", "return", "q-learning", "tq-learning-1", "constant-1"),),
    shares=("best",),
    alternatives=(Alternative("smaller rate", {"alpha": 0.1}),),
)
