"""Whose table all agents go on with after a window.

A rule returns the mixture of tables that every agent continues from: (N,) numbers that sum to 1, a single 1 for a plain
copy, or None to leave every agent its own. To add a rule, write a file with a function and list
that in `SHARING_RULES`: ``SharingRule("tuckerl.generalization.file:function", ...)``.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tuckerl.checks import shown
from tuckerl.errors import ParameterError
from tuckerl.generalization.answers import real_array
from tuckerl.interrupts import may_raise_interrupts
from tuckerl.registers import load
from tuckerl.types import FloatArray, IntArray


class ShareContext(NamedTuple):
    """What a rule may look at after a window of E episodes of N agents."""

    agent_norms: FloatArray  # (N,) row norms of the agent factor Ag_p; ones where nothing was decomposed
    returns: FloatArray  # (E, N) undiscounted returns
    rng: np.random.Generator


ShareFunction = Callable[[ShareContext], ArrayLike | None]
"""What a user may pass as `share`: context in; an agent's index, (N,) mixture weights, or None out."""


class SharingRule(NamedTuple):
    """A sharing rule, and whether it reads `agent_norms`."""

    function: Callable[[ShareContext], FloatArray | None] | str  # or its home
    needs_decomposition: bool
    description: str  # what all agents go on with
    draws: bool = True  # whether it uses the context's generator

    def mix(self, context: ShareContext) -> FloatArray | None:
        """Return the mixture of tables that all agents go on with, (N,), or None."""
        function = load(self.function) if isinstance(self.function, str) else self.function
        mixture: FloatArray | None = function(context)
        return mixture


_TIE = 1e-12  # norms this close differ by rounding only, which must not decide


def _copy_of(agent: int, n_agents: int) -> FloatArray:
    mixture = np.zeros(n_agents)
    mixture[agent] = 1.0
    return mixture


def _max(context: ShareContext) -> FloatArray:
    """Copy the agent that explains the most variance (Figures 5 and 7); the lowest index on ties."""
    norms = context.agent_norms
    return _copy_of(int(np.argmax(norms >= norms.max() * (1 - _TIE))), norms.size)


def _min(context: ShareContext) -> FloatArray:
    """Copy the agent that explains the least variance (Figure 8); the lowest index on ties."""
    norms = context.agent_norms
    return _copy_of(int(np.argmax(norms <= norms.min() * (1 + _TIE))), norms.size)


def _best(context: ShareContext) -> FloatArray:
    """Copy the agent of the highest mean return in the window; the lowest index on ties."""
    return _copy_of(int(np.argmax(context.returns.mean(axis=0))), context.agent_norms.size)


def _random(context: ShareContext) -> FloatArray:
    return _copy_of(int(context.rng.integers(context.agent_norms.size)), context.agent_norms.size)


def _mean(context: ShareContext) -> FloatArray:
    return np.full(context.agent_norms.size, 1.0 / context.agent_norms.size)


def _consensus(context: ShareContext) -> FloatArray:
    """Mix all tables, weighted by the agents' row norms."""
    mixture: FloatArray = context.agent_norms / context.agent_norms.sum()
    return mixture


def _none(context: ShareContext) -> None:
    return None


SHARING_RULES = {
    "max": SharingRule(
        _max, True, "the table of the agent whose row in the agent factor has the largest norm", draws=False
    ),
    "min": SharingRule(_min, True, "the table of the agent whose row has the smallest norm", draws=False),
    "best": SharingRule(_best, False, "the table of the agent with the highest mean return in the window", draws=False),
    "random": SharingRule(_random, False, "the table of a random agent"),
    "mean": SharingRule(_mean, False, "the mean of all tables", draws=False),
    "consensus": SharingRule(_consensus, True, "the mean of all tables weighted by those norms", draws=False),
    "none": SharingRule(_none, False, "each its own table", draws=False),
}


def is_copy(mixture: FloatArray) -> bool:
    """Return whether a mixture (N,) is one agent's table alone."""
    return int(np.count_nonzero(mixture)) == 1


def share_tables(q: FloatArray, mixture: FloatArray, states: IntArray | None) -> None:
    """Let every agent go on with the mixture of all (N, S, A) tables, updated in place.

    Where the `states` are known that differ between tables, only their rows are mixed.
    """
    rows: Any = slice(None) if states is None else states
    if is_copy(mixture):
        q[:, rows] = q[int(np.argmax(mixture)), rows]
    else:
        with np.errstate(over="ignore", invalid="ignore"):  # the end of the next window finds what is not finite
            q[:, rows] = np.tensordot(mixture, q[:, rows], axes=1)


def custom_sharing(function: ShareFunction) -> SharingRule:
    """Return a user's function as a rule whose result is checked."""

    @may_raise_interrupts
    def mix(context: ShareContext) -> FloatArray | None:
        n_agents = context.agent_norms.size
        answer: object = function(context)
        if answer is None:
            return None
        if isinstance(answer, int | np.integer) and not isinstance(answer, bool) and 0 <= answer < n_agents:
            return _copy_of(int(answer), n_agents)
        mixture = real_array("what the share function returns", answer)
        # Written so that NaN fails, too.
        if mixture is not None and mixture.shape == (n_agents,) and abs(mixture.sum() - 1) <= 1e-9:
            return mixture
        raise ParameterError(
            f"the share function must return an agent's index from 0 to {n_agents - 1}, {n_agents} mixture weights "
            f"that sum to 1, or None; got {shown(answer)}"
        )

    return SharingRule(mix, True, "a function of the user's own")
