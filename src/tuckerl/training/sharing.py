"""What becomes of agents' tables, and of all that they declare, where they share at a tensor step.

By what they are mixed is a *mixture*: see :mod:`tuckerl.generalization.mixtures`.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from tuckerl.generalization.mixtures import agent_weights, is_copy, row_weights, share_tables
from tuckerl.generalization.step import Shrinkage, TensorStepResult
from tuckerl.saved_arrays import SavedArrays
from tuckerl.training.declared_state import Declaration, DeclaredArray, DeclaredRecord
from tuckerl.types import FloatArray, IntArray


def share_all(
    result: TensorStepResult,
    q: FloatArray,
    declarations: Sequence[Declaration],
    declared: Sequence[Mapping[str, Any]],
    initial_q: FloatArray,
) -> None:
    """Let every agent go on with what a tensor step says of tables, and with what is declared to be shared with them.

    Parameters
    ----------
    result : TensorStepResult
    q : (N, S, A) float64
        Changed in place, as are all declared arrays.
    declarations : sequence of Declaration
    declared : N mappings
        What each agent holds, by name.
    initial_q : (S, A) float64
    """
    mixture, states = result.mixture, result.states
    if mixture is not None and len(q) > 1:
        share_tables(q, mixture, states)
        for declaration in declarations:
            share_state(declaration, [own[declaration.name] for own in declared], mixture, states, initial_q)
    if result.shrinkage is not None:
        change = shrink_tables(q, result.shrinkage)
        for declaration in declarations:
            if isinstance(declaration, DeclaredArray) and declaration.is_of_values:
                for own, moved in zip(declared, change, strict=True):
                    own[declaration.name][result.shrinkage.states] += moved


def shrink_tables(q: FloatArray, shrinkage: Shrinkage) -> FloatArray:
    """Draw rows of the tables (N, S, A), in place, to what a decomposition says of them; return by how much, (N, C, A).

    Tables of values from which an algorithm makes its Q-table, as Double Q-learning's two, move by as much.
    """
    before = q[:, shrinkage.states]
    q[:, shrinkage.states] = (1.0 - shrinkage.part) * before + shrinkage.part * shrinkage.rows
    change: FloatArray = q[:, shrinkage.states] - before
    return change


def share_state(
    declaration: Declaration, values: list[Any], mixture: FloatArray, states: IntArray | None, initial_q: FloatArray
) -> None:
    """Let all agents go on with a mixture of what they hold.

    Parameters
    ----------
    declaration : Declaration
    values : list
        What each of N agents holds under it; changed in place.
    mixture : (N,) or (N, R, A) float64
        Of whole tables, or of the entries in the rows of R states.
    states : (R,) int64 or None
        The states whose rows can differ between agents; None where that is not known.
    initial_q : (S, A) float64
    """
    heaviest = int(np.argmax(agent_weights(mixture)))
    one_agent = is_copy(mixture)
    if declaration.share == "none":
        return
    if isinstance(declaration, DeclaredRecord):
        for agent, record in enumerate(values):
            if not one_agent:
                record.clear()
            elif agent != heaviest:  # each gets copies of its own, which a record may keep as they are
                record.set_arrays(SavedArrays.of(values[heaviest].to_arrays()))
        return
    if declaration.share in ("heaviest", "copied"):
        source = values[heaviest] if one_agent or declaration.share == "heaviest" else declaration.create(initial_q)
        for array in values:
            if array is not source:
                array[...] = source
        return
    rows: Any = states if states is not None and declaration.is_shared_by_rows else slice(None)
    tables = np.stack([array[rows] for array in values])
    share_tables(tables, _weights_of(declaration, mixture), None)
    if declaration.share == "by_row" and not one_agent:
        np.maximum(tables, 0.0, out=tables)
        sums = tables.sum(axis=-1, keepdims=True)
        tables /= np.where(sums > 0.0, sums, 1.0)  # a row of zeros is no distribution, and stays
    for array, shared in zip(values, tables, strict=True):
        array[rows] = shared


def _weights_of(declaration: DeclaredArray, mixture: FloatArray) -> FloatArray:
    """Return the weights by which an array is mixed: of its entries where they are the Q-table's, else of more."""
    if not declaration.is_shared_by_rows:
        return agent_weights(mixture)
    of_entries = declaration.share == "by_entry" and declaration.shape == ("states", "actions")
    return mixture if of_entries else row_weights(mixture)
