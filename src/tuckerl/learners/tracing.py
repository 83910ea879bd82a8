"""What learners with eligibility traces have in common: their parameters, sharing traces, keeping them in a file."""

from typing import Any, Literal, Unpack

import numpy as np

from tuckerl.adapters.resolve import Environment
from tuckerl.checks import check_flag, check_name, check_real
from tuckerl.learners.traces import ROWS, Decay, empty_traces
from tuckerl.training.learner import Learner
from tuckerl.training.learner_file import Arrays, of_prefix, with_prefix
from tuckerl.training.parameters import LearnerParameters
from tuckerl.types import FloatArray


class TracingLearner(Learner):
    """A learner with eligibility traces.

    Parameters
    ----------
    env
        As for every :class:`~tuckerl.training.learner.Learner`, whose other parameters hold too.
    lambda_ : float in [0, 1]
        How strongly traces last; 0 is the one-step algorithm.
    trace : "replacing" or "accumulating"
        Whether a visit sets a pair's trace to 1 or adds 1 to it.
    carry_trace : bool
        Whether traces go on from one episode to the next. Then a copy of an agent's table takes its trace along, and
        a mixture of tables begins without traces.
    """

    def __init__(
        self,
        env: Environment,
        *,
        lambda_: float = 0.95,
        trace: Literal["replacing", "accumulating"] = "replacing",
        carry_trace: bool = False,
        **parameters: Unpack[LearnerParameters],
    ) -> None:
        super().__init__(env, **parameters)
        self.lambda_ = check_real("lambda_", lambda_, 0.0, 1.0)
        self.trace = check_name("trace", trace, ("replacing", "accumulating"))
        self.carry_trace = check_flag("carry_trace", carry_trace)
        decay = Decay(self.gamma * self.lambda_, self.trace == "replacing", self.carry_trace)
        shape = (self.problem.n_states, self.problem.n_actions)
        self._traces = tuple(empty_traces(*shape, decay) for _ in range(self.n_tables))

    def _share(self, mixture: FloatArray) -> None:
        super()._share(mixture)
        chosen = int(np.argmax(mixture)) if np.count_nonzero(mixture) == 1 else None
        held = None if chosen is None else self._traces_of(chosen)
        for table in range(self.n_tables):
            if table != chosen:
                self._set_traces(table, held)

    def _traces_of(self, table: int) -> Arrays:
        """Return the traces as they are between episodes, when phi is 1 and every row is up to date."""
        traces = self._traces[table]
        slots = slice(1, traces.cursor[ROWS] + 1)
        return {"state": traces.state[slots].copy(), "constant": traces.constant[slots].copy()}

    def _set_traces(self, table: int, held: Arrays | None) -> None:
        """Replace a table's traces by those that `_traces_of` returned, or by none."""
        traces = self._traces[table]
        before = slice(1, traces.cursor[ROWS] + 1)
        traces.slot[traces.state[before]], traces.constant[before], traces.cursor[ROWS] = 0, 0.0, 0
        if held is not None:
            n_rows = held["state"].size
            slots = slice(1, n_rows + 1)
            traces.state[slots], traces.constant[slots] = held["state"], held["constant"]
            traces.slot[held["state"]], traces.cursor[ROWS] = np.arange(1, n_rows + 1), n_rows
            traces.seen[slots], traces.epoch[slots] = 0.0, 0

    def _parameters(self) -> dict[str, Any]:
        own = {"lambda_": self.lambda_, "trace": self.trace, "carry_trace": self.carry_trace}
        return super()._parameters() | own

    def _saved_arrays(self) -> Arrays:
        saved = super()._saved_arrays()
        for table in range(self.n_tables):
            saved |= with_prefix(f"traces{table}", self._traces_of(table))
        return saved

    def _restore_arrays(self, arrays: Arrays) -> None:
        super()._restore_arrays(arrays)
        for table in range(self.n_tables):
            self._set_traces(table, of_prefix(f"traces{table}", arrays))
