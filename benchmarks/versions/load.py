"""What the tensor step costs (claim C8): a T-version's processor time per environment step over its base's.

Over today's base, which decides the claim, and over an older commit's, so that a faster base is no loss. All are played
in turn in processes of their own; each learns as many episodes as a run of the paper's, and what is compiled is left
out. Printed are the ratios of the least times per step.
"""

from typing import Any, NamedTuple

import tuckerl
from benchmarks.versions.rows import Row
from benchmarks.versions.trees import both


class Scenario(NamedTuple):
    """One of the paper's: what is played, and its tensor step."""

    base: Row
    every: int
    ranks: tuple[int, ...]
    share: str


def _maze() -> Any:
    return tuckerl.random_maze(seed=0)


_CART_POLE = {"alpha": 1.0, "gamma": 0.95, "epsilon": 0.001, "epsilon_decay": 0.99, "lambda_": 0.95, "ties": "first"}
_MAZE = {"alpha": 0.1, "gamma": 0.95, "epsilon": 0.1, "planning_steps": 10}
_RESCUE = {"alpha": 0.1, "gamma": 0.95, "epsilon": 0.1, "lambda_": 0.95}

SCENARIOS = {
    "cart pole": Scenario(Row("SarsaLambda", tuckerl.cart_pole, 100, _CART_POLE), 10, (10, 10, 9, 1), "min"),
    "maze": Scenario(Row("DynaH", _maze, 100, _MAZE), 10, (15, 3, 9, 1), "max"),
    "rescue": Scenario(Row("TeamQ", tuckerl.robot_rescue, 100, _RESCUE), 10, (50, 10, 9, 1), "max"),
}


def rows() -> dict[str, Row]:
    """Return the bases, and the T-versions with one agent and with three, by their names."""
    found = {}
    for name, (base, every, ranks, share) in SCENARIOS.items():
        found[f"{name}, base"] = base
        for n in (1, 3):
            step = tuckerl.TensorStep(every=every, ranks=ranks, share=share)
            parameters = {**base.parameters, "n_agents": n, "tensor_step": step}
            found[f"{name}, {n}"] = base._replace(parameters=parameters)
    return found


def compare(old_commit: str, rounds: int, words: str = "") -> None:
    """Print a line for each T-version whose name holds `words`."""
    from benchmarks.versions.speed import Worker  # whose processes import this module

    old, new = both(old_commit)
    head = ("old base", "new base", "T-version", "over old", "over new")
    print(f"{'ns a step, least':<20} " + " ".join(f"{text:>10}" for text in head))
    with Worker(old) as before, Worker(new) as after:
        for scenario in SCENARIOS:
            base = f"{scenario}, base"
            for name in (f"{scenario}, {n}" for n in (1, 3) if words.lower() in scenario):
                played = ((before, base), (after, base), (after, name))
                times = [[_per_step(*worker.time(row)) for worker, row in played] for _ in range(rounds + 1)]
                least = [min(column) for column in zip(*times[1:], strict=True)]
                ratios = [least[2] / least[place] for place in (0, 1)]
                print(f"{name:<20} " + " ".join(f"{n:10.4g}" for n in (*least, *ratios)), flush=True)


def _per_step(seconds: float, steps: int) -> float:
    return seconds / steps * 1e9
