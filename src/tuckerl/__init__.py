"""Tabular reinforcement learning, single- and multi-agent, with knowledge shared through Tucker decompositions.

>>> import tuckerl
>>> agent = tuckerl.DynaH("tuckerl/DynaMaze-v0", seed=0).learn(episodes=20)
>>> agent.steps.shape
(20, 1)

Importing the package registers its environments with Gymnasium. What it offers is loaded on first use, so that the
import costs little more than Gymnasium's own.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from tuckerl import errors
from tuckerl._version import __version__
from tuckerl.problems import register_environments

if TYPE_CHECKING:
    from tuckerl.generalization.step import TensorStep
    from tuckerl.generalization.weights import action_weights
    from tuckerl.learners.dyna_h import DynaH
    from tuckerl.learners.q_learning import QLearning
    from tuckerl.problems.maze import Maze, random_maze, sutton_maze
    from tuckerl.problems.mdp import TabularMDP
    from tuckerl.tensor import TuckerDecomposition, fold, mode_product, tucker, unfold

__all__ = [
    "DynaH",
    "Maze",
    "QLearning",
    "TabularMDP",
    "TensorStep",
    "TuckerDecomposition",
    "__version__",
    "action_weights",
    "errors",
    "fold",
    "mode_product",
    "random_maze",
    "sutton_maze",
    "tucker",
    "unfold",
]

_HOMES = {
    "DynaH": "learners.dyna_h",
    "Maze": "problems.maze",
    "QLearning": "learners.q_learning",
    "TabularMDP": "problems.mdp",
    "TensorStep": "generalization.step",
    "TuckerDecomposition": "tensor",
    "action_weights": "generalization.weights",
    "fold": "tensor",
    "mode_product": "tensor",
    "random_maze": "problems.maze",
    "sutton_maze": "problems.maze",
    "tucker": "tensor",
    "unfold": "tensor",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'tuckerl' has no attribute {name!r}")
    value = getattr(import_module(f"tuckerl.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__


register_environments()
