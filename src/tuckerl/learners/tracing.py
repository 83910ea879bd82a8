"""What learners with eligibility traces have in common: their parameters, and how they act and end an episode."""

from typing import Any, Literal, Unpack

from tuckerl._jit import kernel
from tuckerl.adapters.resolve import Environment
from tuckerl.checks import check_flag, check_name, check_real
from tuckerl.learners.traces import Decay, Trace, empty_traces, flush_traces, sync_row
from tuckerl.training.agent_arrays import AgentArrays
from tuckerl.training.declared_state import Declaration, DeclaredRecord
from tuckerl.training.learner import Learner
from tuckerl.training.parameters import LearnerParameters
from tuckerl.training.policies.policy import choose


@kernel
def act_on_synced_row(algorithm: Any, agent: AgentArrays, state: int) -> int:
    """Bring a row of ``agent.q`` (S, A) up to date, and let the policy choose by it."""
    sync_row(algorithm.traces, agent.q, agent.step_sizes, agent.log, state)
    return choose(agent.policy, agent, state)


@kernel
def end_with_traces(algorithm: Any, agent: AgentArrays, finished: bool) -> bool:
    """Bring all rows of ``agent.q`` (S, A) up to date and return whether they are finite.

    Traces go on into the next episode only if they are to, and this one was finished.
    """
    keep = finished and algorithm.traces.decay.carried
    return flush_traces(algorithm.traces, agent.q, agent.step_sizes, agent.log, keep)


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
        self.lambda_ = check_real("lambda_", lambda_, 0.0, 1.0)
        self.trace = check_name("trace", trace, ("replacing", "accumulating"))
        self.carry_trace = check_flag("carry_trace", carry_trace)
        super().__init__(env, **parameters)

    def declare_state(self) -> tuple[Declaration, ...]:
        """Return the traces, which go along with a copied table."""
        decay = Decay(self.gamma * self.lambda_, int(Trace[self.trace.upper()]), self.carry_trace)
        return (
            DeclaredRecord("traces", "copied", lambda n_states, n_actions: empty_traces(n_states, n_actions, decay)),
        )
