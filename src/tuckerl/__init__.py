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
from tuckerl.environments import register_environments

if TYPE_CHECKING:
    from tuckerl import testing
    from tuckerl._jit import kernel
    from tuckerl.adapters.joint import JointEnv
    from tuckerl.adapters.quantiles import quantile_edges
    from tuckerl.adapters.split import SplitEnv
    from tuckerl.environments.cart_pole import cart_pole
    from tuckerl.environments.robot_rescue import robot_rescue
    from tuckerl.generalization.step import TensorStep
    from tuckerl.generalization.weights import action_weights
    from tuckerl.learners.dyna_h import DynaH
    from tuckerl.learners.loading import load
    from tuckerl.learners.q_learning import QLearning
    from tuckerl.learners.sarsa import Sarsa
    from tuckerl.learners.sarsa_lambda import SarsaLambda
    from tuckerl.learners.team_q import TeamQ
    from tuckerl.problems.maze import Maze, random_maze, sutton_maze
    from tuckerl.problems.mdp import TabularMDP
    from tuckerl.problems.simulator import Simulator
    from tuckerl.tensor import TuckerDecomposition, fold, mode_product, tucker, unfold
    from tuckerl.training.callbacks.base import Callback
    from tuckerl.training.callbacks.checkpoint import Checkpoint
    from tuckerl.training.callbacks.evaluate import Evaluate
    from tuckerl.training.callbacks.logs import CsvLog, JsonLinesLog
    from tuckerl.training.callbacks.stop_on_return import StopOnReturn
    from tuckerl.training.callbacks.tensorboard import TensorBoard
    from tuckerl.training.evaluation import Evaluation
    from tuckerl.training.schedules import Exponential, Harmonic, Linear

__all__ = [
    "Callback",
    "Checkpoint",
    "CsvLog",
    "DynaH",
    "Evaluate",
    "Evaluation",
    "Exponential",
    "Harmonic",
    "JointEnv",
    "JsonLinesLog",
    "Linear",
    "Maze",
    "QLearning",
    "Sarsa",
    "SarsaLambda",
    "Simulator",
    "SplitEnv",
    "StopOnReturn",
    "TabularMDP",
    "TeamQ",
    "TensorBoard",
    "TensorStep",
    "TuckerDecomposition",
    "__version__",
    "action_weights",
    "cart_pole",
    "errors",
    "fold",
    "kernel",
    "load",
    "mode_product",
    "quantile_edges",
    "random_maze",
    "robot_rescue",
    "sutton_maze",
    "testing",
    "tucker",
    "unfold",
]

_HOMES = {
    "Callback": "training.callbacks.base",
    "Checkpoint": "training.callbacks.checkpoint",
    "CsvLog": "training.callbacks.logs",
    "DynaH": "learners.dyna_h",
    "Evaluate": "training.callbacks.evaluate",
    "Evaluation": "training.evaluation",
    "Exponential": "training.schedules",
    "Harmonic": "training.schedules",
    "JointEnv": "adapters.joint",
    "JsonLinesLog": "training.callbacks.logs",
    "Linear": "training.schedules",
    "Maze": "problems.maze",
    "QLearning": "learners.q_learning",
    "Sarsa": "learners.sarsa",
    "SarsaLambda": "learners.sarsa_lambda",
    "Simulator": "problems.simulator",
    "SplitEnv": "adapters.split",
    "StopOnReturn": "training.callbacks.stop_on_return",
    "TabularMDP": "problems.mdp",
    "TeamQ": "learners.team_q",
    "TensorBoard": "training.callbacks.tensorboard",
    "TensorStep": "generalization.step",
    "TuckerDecomposition": "tensor",
    "action_weights": "generalization.weights",
    "cart_pole": "environments.cart_pole",
    "fold": "tensor",
    "kernel": "_jit",
    "load": "learners.loading",
    "mode_product": "tensor",
    "quantile_edges": "adapters.quantiles",
    "random_maze": "problems.maze",
    "robot_rescue": "environments.robot_rescue",
    "sutton_maze": "problems.maze",
    "tucker": "tensor",
    "unfold": "tensor",
}


def __getattr__(name: str) -> Any:
    if name == "testing":  # a module, as `errors` is, but one that loads all of the library
        return import_module("tuckerl.testing")
    if name not in _HOMES:
        raise AttributeError(f"module 'tuckerl' has no attribute {name!r}")
    value = getattr(import_module(f"tuckerl.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__


register_environments()
