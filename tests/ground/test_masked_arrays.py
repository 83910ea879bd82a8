"""A mask says that numbers are none: wherever arrays are taken, it is refused, and the way out is named."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from gymnasium.spaces import Box, Discrete

from tests.learners.worlds import corridor
from tests.problems.test_simulator import reset, step
from tuckerl import DynaH, Maze, QLearning, Simulator, TabularMDP, TensorStep, action_weights, tucker
from tuckerl.adapters.masks import MaskReader
from tuckerl.errors import ParameterTypeError
from tuckerl.reports.inspect import inspect_tensor
from tuckerl.spaces.encoder import space_encoder
from tuckerl.tensor import fold, mode_product, unfold

Masked = np.ma.MaskedArray[Any, Any]


def masked(shape: Any, dtype: Any = np.float64) -> Masked:
    array = np.ma.ones(shape, dtype=dtype)
    array[(0,) * array.ndim] = np.ma.masked
    return array


def table(**changed: Any) -> TabularMDP:
    parts: dict[str, Any] = {"next_state": [[0, 1]] * 2, "reward": np.zeros((2, 2)), "terminated": [[True] * 2] * 2}
    return TabularMDP(**(parts | changed))


def shares(answer: Callable[..., Any], **step: Any) -> QLearning:
    settings: dict[str, Any] = {"every": 1, "ranks": (1, 1, 1, 1)} | step
    return QLearning(corridor(2), n_agents=2, initial_q=1.0, seed=0, tensor_step=TensorStep(**settings)).learn(1)


PLACES: dict[str, Callable[[], Any]] = {
    "tucker": lambda: tucker(masked((3, 3, 3)), (1, 1, 1)),
    "tucker of a list": lambda: tucker([masked((3, 3)), masked((3, 3))], (1, 1, 1)),
    "unfold": lambda: unfold(masked((3, 3)), 0),
    "fold": lambda: fold(masked((3, 9)), 0, (3, 3, 3)),
    "mode_product": lambda: mode_product(np.ones((3, 3)), masked((3, 3)), 0),
    "action_weights": lambda: action_weights(masked((3, 1))),
    "inspect_tensor": lambda: inspect_tensor(masked((3, 3, 3, 3)), (1, 1, 1, 1)),
    "initial_q": lambda: QLearning(corridor(5), initial_q=masked((5, 2))),
    "heuristic": lambda: DynaH(corridor(5), heuristic=masked(5)),
    "next_state": lambda: table(next_state=masked((2, 2), np.int64)),
    "reward": lambda: table(reward=masked((2, 2))),
    "terminated": lambda: table(terminated=masked((2, 2), np.bool_)),
    "probability": lambda: TabularMDP([[[0]]], [[[0.0]]], [[[True]]], masked((1, 1, 1))),
    "start": lambda: table(start=masked(2)),
    "action_mask": lambda: table(action_mask=masked((2, 2), np.bool_)),
    "walls": lambda: Maze(masked((3, 3), np.bool_), (0, 0), (2, 2)),
    "parameters": lambda: Simulator(reset, step, n_states=2, n_actions=2, parameters=masked(3)),
    "predict": lambda: QLearning(corridor(5)).predict(masked(5, np.int64)),
    "observations": lambda: space_encoder(Discrete(3)).encode_many(masked(3, np.int64)),
    "an observation": lambda: space_encoder(Box(0, 1, (3,)), bins=2).encode(masked(3)),
    "bins": lambda: space_encoder(Box(0, 1, (3,)), bins=masked(3, np.int64)),
    "edges": lambda: space_encoder(Box(0, 1, (1,)), bins=[masked(3)]),
    "an environment's mask": lambda: MaskReader(Discrete(3), Discrete(3))(0, {"action_mask": masked(3, np.int8)}),
    "weights": lambda: shares(None, weights=lambda decomposition: masked(2)),  # type: ignore[arg-type]  # a masked array is none, which is what is tested
    "share": lambda: shares(None, share=lambda context: masked(2)),  # type: ignore[arg-type]  # a masked array is none, which is what is tested
}


@pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")
@pytest.mark.parametrize("place", PLACES)
def test_a_masked_array_is_refused(place: str) -> None:
    with pytest.raises(ParameterTypeError, match=r"must have no mask.*got a masked array.*numpy\.ma\.filled"):
        PLACES[place]()
