# Written by `make format` from the registers.

from tuckerl import errors as errors
from tuckerl import testing as testing
from tuckerl._jit import kernel as kernel
from tuckerl._version import __version__ as __version__
from tuckerl.adapters.joint import JointEnv as JointEnv
from tuckerl.adapters.quantiles import quantile_edges as quantile_edges
from tuckerl.adapters.split import SplitEnv as SplitEnv
from tuckerl.environments.cart_pole import cart_pole as cart_pole
from tuckerl.environments.robot_rescue import robot_rescue as robot_rescue
from tuckerl.generalization.tensor_step import TensorStep as TensorStep
from tuckerl.generalization.weights import action_weights as action_weights
from tuckerl.learners.double_q_learning import DoubleQLearning as DoubleQLearning
from tuckerl.learners.dyna_h import DynaH as DynaH
from tuckerl.learners.dyna_q import DynaQ as DynaQ
from tuckerl.learners.dyna_q_plus import DynaQPlus as DynaQPlus
from tuckerl.learners.expected_sarsa import ExpectedSarsa as ExpectedSarsa
from tuckerl.learners.haql import HAQL as HAQL
from tuckerl.learners.loading import load as load
from tuckerl.learners.monte_carlo import MonteCarlo as MonteCarlo
from tuckerl.learners.n_step_sarsa import NStepSarsa as NStepSarsa
from tuckerl.learners.prioritized_sweeping import PrioritizedSweeping as PrioritizedSweeping
from tuckerl.learners.q_learning import QLearning as QLearning
from tuckerl.learners.r_learning import RLearning as RLearning
from tuckerl.learners.r_max import RMax as RMax
from tuckerl.learners.sarsa import Sarsa as Sarsa
from tuckerl.learners.sarsa_lambda import SarsaLambda as SarsaLambda
from tuckerl.learners.team_q import TeamQ as TeamQ
from tuckerl.learners.tree_backup import TreeBackup as TreeBackup
from tuckerl.learners.true_online_sarsa_lambda import TrueOnlineSarsaLambda as TrueOnlineSarsaLambda
from tuckerl.learners.watkins_q_lambda import WatkinsQLambda as WatkinsQLambda
from tuckerl.problems.maze import Maze as Maze
from tuckerl.problems.maze import random_maze as random_maze
from tuckerl.problems.maze import sutton_maze as sutton_maze
from tuckerl.problems.mdp import TabularMDP as TabularMDP
from tuckerl.problems.simulator import Simulator as Simulator
from tuckerl.reports.study import Study as Study
from tuckerl.solving.policy_value import policy_value as policy_value
from tuckerl.solving.solve import Solution as Solution
from tuckerl.solving.solve import solve as solve
from tuckerl.tensor import TuckerDecomposition as TuckerDecomposition
from tuckerl.tensor import fold as fold
from tuckerl.tensor import mode_product as mode_product
from tuckerl.tensor import tucker as tucker
from tuckerl.tensor import unfold as unfold
from tuckerl.training.callbacks.base import Callback as Callback
from tuckerl.training.callbacks.checkpoint import Checkpoint as Checkpoint
from tuckerl.training.callbacks.evaluate import Evaluate as Evaluate
from tuckerl.training.callbacks.logs import CsvLog as CsvLog
from tuckerl.training.callbacks.logs import JsonLinesLog as JsonLinesLog
from tuckerl.training.callbacks.stop_on_return import StopOnReturn as StopOnReturn
from tuckerl.training.callbacks.tensorboard import TensorBoard as TensorBoard
from tuckerl.training.evaluation import Evaluation as Evaluation
from tuckerl.training.policies.epsilon_greedy import EpsilonGreedy as EpsilonGreedy
from tuckerl.training.policies.greedy import Greedy as Greedy
from tuckerl.training.policies.own_distribution import OwnDistribution as OwnDistribution
from tuckerl.training.policies.softmax import Softmax as Softmax
from tuckerl.training.policies.ucb import UCB as UCB
from tuckerl.training.regret import Regret as Regret
from tuckerl.training.regret import regret as regret
from tuckerl.training.schedules import Exponential as Exponential
from tuckerl.training.schedules import Harmonic as Harmonic
from tuckerl.training.schedules import Linear as Linear

__all__ = [
    "HAQL",
    "UCB",
    "Callback",
    "Checkpoint",
    "CsvLog",
    "DoubleQLearning",
    "DynaH",
    "DynaQ",
    "DynaQPlus",
    "EpsilonGreedy",
    "Evaluate",
    "Evaluation",
    "ExpectedSarsa",
    "Exponential",
    "Greedy",
    "Harmonic",
    "JointEnv",
    "JsonLinesLog",
    "Linear",
    "Maze",
    "MonteCarlo",
    "NStepSarsa",
    "OwnDistribution",
    "PrioritizedSweeping",
    "QLearning",
    "RLearning",
    "RMax",
    "Regret",
    "Sarsa",
    "SarsaLambda",
    "Simulator",
    "Softmax",
    "Solution",
    "SplitEnv",
    "StopOnReturn",
    "Study",
    "TabularMDP",
    "TeamQ",
    "TensorBoard",
    "TensorStep",
    "TreeBackup",
    "TrueOnlineSarsaLambda",
    "TuckerDecomposition",
    "WatkinsQLambda",
    "__version__",
    "action_weights",
    "cart_pole",
    "errors",
    "fold",
    "kernel",
    "load",
    "mode_product",
    "policy_value",
    "quantile_edges",
    "random_maze",
    "regret",
    "robot_rescue",
    "solve",
    "sutton_maze",
    "testing",
    "tucker",
    "unfold",
]
_HOMES: dict[str, str]
