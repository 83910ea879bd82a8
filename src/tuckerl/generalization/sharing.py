"""Whose table all agents go on with after a window.

A rule returns the mixture of tables that every agent continues from: (N,) numbers that sum to 1, a single 1 for a plain
copy; (N, R, A) numbers that sum to 1 over the agents, to mix each entry of R rows in its own way; or None to leave
every agent its own. To add a rule, write a file with a function and list that in `SHARING_RULES`:
``SharingRule("tuckerl.generalization.file:function", ...)``.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tuckerl.checks import shown
from tuckerl.errors import ParameterError
from tuckerl.generalization.answers import real_array
from tuckerl.generalization.mixtures import copy_of
from tuckerl.interrupts import may_raise_interrupts
from tuckerl.registers import load
from tuckerl.types import FloatArray, IntArray

_NO_ROWS: FloatArray = np.zeros((0, 0, 0))
_NO_STATES: IntArray = np.zeros(0, dtype=np.int64)
_NO_CHANGES: IntArray = np.zeros((0, 0, 0), dtype=np.int64)


class ShareContext(NamedTuple):
    """What a rule may look at after a window of E episodes of N agents, over A actions.

    The R states are those whose rows may differ between agents: somebody changed them in the window, or an earlier
    window left them different. One agent alone has none.
    """

    norms: FloatArray | None  # (N,) as of `agent_norms`; None where nothing was decomposed
    returns: FloatArray  # (E, N) undiscounted returns
    rng: np.random.Generator
    states: IntArray = _NO_STATES  # (R,)
    rows: FloatArray = _NO_ROWS  # (N, R, A) their rows at the end of the window
    changes: IntArray = _NO_CHANGES  # (N, R, A) in how many of the window's episodes each agent changed each entry

    @property
    def agent_norms(self) -> FloatArray:
        """Row norms of the agent factor Ag_p, (N,).

        Raises
        ------
        ParameterError
            If nothing was decomposed, as the tensor step has no ranks.
        """
        if self.norms is None:
            raise ParameterError(
                "agent_norms are the row norms of a decomposition's agent factor, and nothing was decomposed: give "
                "TensorStep ranks, or read returns, rows and changes instead"
            )
        return self.norms


ShareFunction = Callable[[ShareContext], ArrayLike | None]
"""What a user may pass as `share`: context in; an agent's index, (N,) or (N, R, A) mixture weights, or None out."""


class SharingRule(NamedTuple):
    """A sharing rule, and whether it reads `agent_norms`."""

    function: Callable[[ShareContext], FloatArray | None] | str  # or its home
    needs_decomposition: bool
    description: str  # what all agents go on with
    draws: bool = True  # whether it uses the context's generator
    needs_changes: bool = False  # whether it reads the context's states, rows or changes

    def mix(self, context: ShareContext) -> FloatArray | None:
        """Return the mixture that all agents go on with, of tables, (N,), or of their entries, (N, R, A), or None."""
        function = load(self.function) if isinstance(self.function, str) else self.function
        mixture: FloatArray | None = function(context)
        return mixture


_TIE = 1e-12  # norms this close differ by rounding only, which must not decide


def _n_agents(context: ShareContext) -> int:
    return int(context.returns.shape[1])


def _max(context: ShareContext) -> FloatArray:
    """Copy the agent that explains the most variance (Figures 5 and 7); the lowest index on ties."""
    norms = context.agent_norms
    return copy_of(int(np.argmax(norms >= norms.max() * (1 - _TIE))), norms.size)


def _min(context: ShareContext) -> FloatArray:
    """Copy the agent that explains the least variance (Figure 8); the lowest index on ties."""
    norms = context.agent_norms
    return copy_of(int(np.argmax(norms <= norms.min() * (1 + _TIE))), norms.size)


def _best(context: ShareContext) -> FloatArray:
    """Copy the agent of the highest mean return in the window; the lowest index on ties."""
    return copy_of(int(np.argmax(context.returns.mean(axis=0))), _n_agents(context))


def _random(context: ShareContext) -> FloatArray:
    return copy_of(int(context.rng.integers(_n_agents(context))), _n_agents(context))


def _mean(context: ShareContext) -> FloatArray:
    return np.full(_n_agents(context), 1.0 / _n_agents(context))


def _consensus(context: ShareContext) -> FloatArray:
    """Mix all tables, weighted by the agents' row norms."""
    mixture: FloatArray = context.agent_norms / context.agent_norms.sum()
    return mixture


def _visits(context: ShareContext) -> FloatArray:
    """Weigh each entry's values by who changed it in how many episodes; by nothing where nobody did."""
    counts = context.changes
    total = counts.sum(axis=0)
    return np.where(total > 0, counts / np.maximum(total, 1), 1.0 / _n_agents(context))


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
    "visits": SharingRule(
        _visits,
        False,
        "entry by entry, the mean weighted by in how many of the window's episodes each agent changed the entry",
        draws=False,
        needs_changes=True,
    ),
    "consensus": SharingRule(_consensus, True, "the mean of all tables weighted by those norms", draws=False),
    "none": SharingRule(_none, False, "each its own table", draws=False),
}


def custom_sharing(function: ShareFunction, *, reads_norms: bool) -> SharingRule:
    """Return a user's function as a rule whose result is checked."""

    @may_raise_interrupts
    def mix(context: ShareContext) -> FloatArray | None:
        n_agents, n_rows = context.returns.shape[1], context.states.size
        answer: object = function(context)
        if answer is None:
            return None
        if isinstance(answer, int | np.integer) and not isinstance(answer, bool) and 0 <= answer < n_agents:
            return copy_of(int(answer), n_agents)
        mixture = real_array("what the share function returns", answer)
        shapes = ((n_agents,), context.changes.shape)
        # Written so that NaN fails, too.
        if mixture is not None and mixture.shape in shapes and (np.abs(mixture.sum(axis=0) - 1) <= 1e-9).all():
            return mixture
        raise ParameterError(
            f"the share function must return an agent's index from 0 to {n_agents - 1}, {n_agents} mixture weights "
            f"that sum to 1, weights {context.changes.shape} of the entries of {n_rows} rows that sum to 1 over the "
            f"agents, or None; got {shown(answer)}"
        )

    return SharingRule(mix, reads_norms, "a function of the user's own", needs_changes=True)
