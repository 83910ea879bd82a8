"""Tabular reinforcement learning, single- and multi-agent, with knowledge shared through Tucker decompositions.

>>> import tuckerl
>>> agent = tuckerl.DynaH("tuckerl/DynaMaze-v0", seed=0).learn(episodes=20)
>>> agent.steps.shape
(20, 1)

Importing the package registers its environments with Gymnasium. What it offers is loaded on first use, so that the
import costs little more than Gymnasium's own.
"""

from importlib import import_module
from typing import Any

from tuckerl import errors as errors
from tuckerl._version import __version__ as __version__
from tuckerl.environments import register_environments
from tuckerl.learners import LEARNERS
from tuckerl.training.policies import POLICIES

_HOMES = {
    "Callback": "training.callbacks.base",
    "Checkpoint": "training.callbacks.checkpoint",
    "CsvLog": "training.callbacks.logs",
    "Evaluate": "training.callbacks.evaluate",
    "Evaluation": "training.evaluation",
    "Exponential": "training.schedules",
    "Harmonic": "training.schedules",
    "JointEnv": "adapters.joint",
    "JsonLinesLog": "training.callbacks.logs",
    "Linear": "training.schedules",
    "Maze": "problems.maze",
    "Simulator": "problems.simulator",
    "SplitEnv": "adapters.split",
    "StopOnReturn": "training.callbacks.stop_on_return",
    "TabularMDP": "problems.mdp",
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
_HOMES |= {entry.class_name: f"learners.{entry.module}" for entry in LEARNERS}
_HOMES |= {name: f"training.policies.{entry.module}" for name, entry in POLICIES.items()}

__all__ = sorted([*_HOMES, "__version__", "errors", "testing"])  # the registers say what is in it


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
