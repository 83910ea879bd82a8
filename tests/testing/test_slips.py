"""Kernels that reach outside of their arrays are found before they are compiled, and named; the check survives them."""

import os
import signal
import sys
from typing import Any, NamedTuple

import numpy as np
import pytest

import tuckerl
from tuckerl import DynaH, QLearning, SarsaLambda, TeamQ
from tuckerl.errors import LearnerCheckError
from tuckerl.testing import check_learner, slips
from tuckerl.testing.interpreting import interpreted
from tuckerl.testing.small_problems import masked, slippery
from tuckerl.testing.subject import EVERY, Subject
from tuckerl.training.agent_arrays import AgentArrays, Transition
from tuckerl.training.algorithm import register_algorithm
from tuckerl.training.greedy_actions import best_value
from tuckerl.training.kernel_calls import KernelCall
from tuckerl.training.learner import Learner
from tuckerl.training.loop import play
from tuckerl.types import FloatArray

NONE, READS, WRITES, PASSES_ON, DIES, NEVER = range(6)


class ReachingState(NamedTuple):
    """An algorithm that reaches too far."""

    how: int
    sums: FloatArray  # (3,)


@tuckerl.kernel
def passed_on(agent: AgentArrays, state: int) -> float:
    return best_value(agent.q, agent.action_mask, state + 1000)


def die() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


@tuckerl.kernel
def update(algorithm: ReachingState, agent: AgentArrays, transition: Transition, next_action: int) -> bool:
    if algorithm.how == READS:
        return bool(agent.q[transition.state, agent.q.shape[1]] == 0.0)
    if algorithm.how == WRITES:
        algorithm.sums[3] += transition.reward
    if algorithm.how == PASSES_ON:
        return passed_on(agent, transition.state) == 0.0
    if algorithm.how == DIES:
        die()
    while algorithm.how == NEVER:
        pass
    return True


register_algorithm(ReachingState, update=update)


class Reaching(Learner):
    """A learner that reaches too far."""

    state_type = ReachingState
    how = NONE

    def constants(self) -> dict[str, Any]:
        return {"how": self.how, "sums": np.zeros(3)}


def reaching(how: int) -> Any:
    """A class that no other process could import."""
    return type("Reaching", (Reaching,), {"how": how})


@pytest.mark.parametrize(
    ("how", "message"),
    [
        (
            READS,
            r"of Reaching, update \(line \d+ of test_slips.py\) reached for agent.q\[\d, 3\], whose shape is \(6, 3\)$",
        ),
        (WRITES, r"update \(line \d+ of test_slips.py\) reached for agent.algorithm.sums\[3\], whose shape is \(3,\)$"),
        (
            PASSES_ON,
            r"largest_entries \(line \d+ of row_maxima.py\) reached for agent.q\[100\d, 0\], whose shape is \(6, 3\), "
            r"as passed_on \(line \d+ of test_slips.py\) asked it to$",
        ),
        (DIES, r"its kernels ended the interpreter \(exit status -9\)$"),
        (NEVER, r"its kernels did not come back within .* seconds of plain Python: does a loop in them never end\?$"),
    ],
)
@pytest.mark.skipif(sys.platform == "win32", reason="a process cannot be forked there")
def test_who_reaches_too_far_is_named(how: int, message: str, monkeypatch: pytest.MonkeyPatch) -> None:
    if how == NEVER:
        monkeypatch.setattr(slips, "_PATIENCE", 1.0)
    with pytest.raises(LearnerCheckError, match="kernels must stay within their arrays; .*" + message) as caught:
        check_learner(reaching(how))
    assert len(str(caught.value)) < 600


@pytest.mark.parametrize("kind", [QLearning, SarsaLambda, TeamQ, DynaH])
def test_interpreted_kernels_do_what_compiled_ones_do(kind: Any) -> None:
    for problem in (slippery(), masked()):
        subject = Subject(kind, {})
        step = subject.tensor_step()
        python, compiled = (subject.on(problem, n_agents=1, tensor_step=step) for _ in range(2))
        state = python._state
        world, call = state.worlds[0], KernelCall(calls_python=True)
        agent = state.agent(0, EVERY - 1, 10**9, world.action_masks[0], python.algorithm_state, call)
        found: list[str] = []
        with np.errstate(over="ignore"):  # of the generator's words, as is meant
            assert interpreted(play)(world.arrays, slips._watched(agent, "agent", found)) == EVERY - 1
        compiled.learn(EVERY - 1)
        assert not found
        np.testing.assert_allclose(python.q, compiled.q, rtol=1e-12, atol=1e-12)
        assert compiled.q.any()
