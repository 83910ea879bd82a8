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
    "Callback": "tuckerl.training.callbacks.base",
    "Checkpoint": "tuckerl.training.callbacks.checkpoint",
    "CsvLog": "tuckerl.training.callbacks.logs",
    "Evaluate": "tuckerl.training.callbacks.evaluate",
    "Evaluation": "tuckerl.training.evaluation",
    "Exponential": "tuckerl.training.schedules",
    "Harmonic": "tuckerl.training.schedules",
    "JointEnv": "tuckerl.adapters.joint",
    "JsonLinesLog": "tuckerl.training.callbacks.logs",
    "Linear": "tuckerl.training.schedules",
    "Maze": "tuckerl.problems.maze",
    "Regret": "tuckerl.training.regret",
    "Simulator": "tuckerl.problems.simulator",
    "Solution": "tuckerl.solving.solve",
    "SplitEnv": "tuckerl.adapters.split",
    "StopOnReturn": "tuckerl.training.callbacks.stop_on_return",
    "Study": "tuckerl.reports.study",
    "TabularMDP": "tuckerl.problems.mdp",
    "TensorBoard": "tuckerl.training.callbacks.tensorboard",
    "TensorStep": "tuckerl.generalization.tensor_step",
    "TuckerDecomposition": "tuckerl.tensor",
    "action_weights": "tuckerl.generalization.weights",
    "cart_pole": "tuckerl.environments.cart_pole",
    "fold": "tuckerl.tensor",
    "kernel": "tuckerl._jit",
    "load": "tuckerl.learners.loading",
    "mode_product": "tuckerl.tensor",
    "policy_value": "tuckerl.solving.policy_value",
    "quantile_edges": "tuckerl.adapters.quantiles",
    "random_maze": "tuckerl.problems.maze",
    "regret": "tuckerl.training.regret",
    "robot_rescue": "tuckerl.environments.robot_rescue",
    "solve": "tuckerl.solving.solve",
    "sutton_maze": "tuckerl.problems.maze",
    "tucker": "tuckerl.tensor",
    "unfold": "tuckerl.tensor",
}
_HOMES |= {entry.class_name: entry.home for entry in LEARNERS}
_HOMES |= {name: entry.home for name, entry in POLICIES.items()}

__all__ = sorted([*_HOMES, "__version__", "errors", "testing"])  # the registers say what is in it


def __getattr__(name: str) -> Any:
    if name == "testing":  # a module, as `errors` is, but one that loads all of the library
        return import_module("tuckerl.testing")
    if name not in _HOMES:
        raise AttributeError(f"module 'tuckerl' has no attribute {name!r}")
    value = getattr(import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__


register_environments()
