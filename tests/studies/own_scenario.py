"""A scenario as a user writes one: Q-learning on the frozen lake, measured by return, with nothing said of figures."""

from dataclasses import replace

import polars as pl

from tests.structure.additions.lake import LAKE
from tuckerl.studies.assumptions import INVENTED, Assumption
from tuckerl.studies.study import Comparison

MEAN_RETURN, BEST_RETURN = pl.col("return").mean(), pl.col("return").max()

FROZEN_LAKE = replace(
    LAKE,
    n_runs=10,
    n_episodes=40,
    comparisons=(
        Comparison("L1", "the tensor step helps", "return", "q-learning", "tq-learning-1", "constant-1"),
        Comparison("L2", "agents help each other", "final", "tq-learning-1", "tq-learning-3", "constant-3-best"),
    ),
    assumptions=(Assumption(INVENTED, "The ice is slippery."),),
)
