"""How the files of formats 2 and 3 in `saved_files` were made; they are kept for ever, so do not make them anew.

Each learner was saved after 6 episodes (of a window of 4 where there is a tensor step); ``formatN_after.npz`` holds its
tables, steps and returns after 6 more. A new format gets a function and files of its own: ``python -m
tests.training.make_saved_files FOLDER`` writes those of the present one.
"""

import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from tests.adapters.parallel_worlds import Dice, Leaving, Masked
from tests.learners.stepped_worlds import SeededTableEnv, TableEnv
from tests.learners.test_masks import masked_mdp
from tests.learners.worlds import corridor, drift, random_mdp
from tuckerl import DynaH, Exponential, Harmonic, JointEnv, QLearning, Sarsa, SarsaLambda, TeamQ, TensorStep
from tuckerl.training.learner_file import FORMAT_VERSION

STEP = TensorStep(every=4, ranks=(3, 2, 3, 2), floor=0.1)
MDP = random_mdp(6, n_states=6, n_outcomes=2, random_start=True, limit=20)
MASKED = masked_mdp(6, n_states=6, n_outcomes=2, limit=20)

ENVIRONMENTS: dict[str, Callable[[], Any]] = {
    "simulator": drift,
    "generator": lambda: SeededTableEnv(MDP),
    "reseeded": lambda: TableEnv(MASKED),
    "players": lambda: Leaving((2, 1, 3)),
    "masked_players": Masked,
    "joint": lambda: JointEnv(Dice()),
}
"""What load() must be given for these; the others hold their problem, or its id."""


def learners() -> dict[str, Any]:
    """One of each kind, before its first episode."""
    made = ENVIRONMENTS
    return {
        "lifted": QLearning(MDP, seed=1, n_agents=2, tensor_step=STEP, alpha=Harmonic(0.5, 20), initial_q=0.25),
        "masked": Sarsa(MASKED, seed=2, epsilon=Exponential(0.9, 0.9, 0.05), ties="first"),
        "dyna": DynaH(corridor(), seed=3, n_agents=2, planning_steps=3, tensor_step=STEP),
        "team": TeamQ(random_mdp(7, n_actions=6, action_sizes=(2, 3)), seed=4, carry_trace=True, cut_traces=False),
        "simulator": SarsaLambda(made["simulator"](), seed=5, n_agents=2, carry_trace=True, tensor_step=STEP),
        "generator": SarsaLambda(made["generator"](), seed=6, n_agents=2, carry_trace=True, tensor_step=STEP),
        "reseeded": QLearning(made["reseeded"](), seed=7, n_agents=2),
        "identified": QLearning("FrozenLake-v1", compiled=False, seed=8),
        "binned": QLearning("CartPole-v1", bins=[[-1, 1], [-0.5, 0.5], [-0.1, 0.0, 0.1], [-1, 1]], seed=9),
        "players": QLearning(made["players"](), seed=10, tensor_step=STEP, epsilon=0.5),
        "masked_players": SarsaLambda(made["masked_players"](), seed=11, trace="accumulating", alpha=0.05),
        "joint": TeamQ(made["joint"](), seed=12, exploration="joint", epsilon=0.3),
    }


def main(folder: Path) -> None:
    warnings.simplefilter("ignore")
    after: dict[str, np.ndarray] = {}
    for name, learner in learners().items():
        learner.learn(6).save(folder / f"format{FORMAT_VERSION}_{name}.tuckerl")
        learner.learn(6)
        after |= {f"{name}.q": learner.q, f"{name}.steps": learner.steps, f"{name}.returns": learner.returns}
    np.savez_compressed(folder / f"format{FORMAT_VERSION}_after.npz", **after)  # type: ignore[arg-type]  # its own names


if __name__ == "__main__":
    main(Path(sys.argv[1]))
