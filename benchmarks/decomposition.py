"""The Tucker decomposition against TensorLy's default, on the maze's own Q-tables and on a large tensor."""

import numpy as np
from tensorly.decomposition import tucker as tensorly_tucker
from tensorly.tucker_tensor import tucker_to_tensor

from benchmarks.timing import Row, compare
from tuckerl import DynaH, random_maze, tucker
from tuckerl.types import FloatArray, Ranks


def rows() -> list[Row]:
    """Time both on three tensors; refuse to compare where ours fits worse."""
    return [
        _row("maze tables (1404, 4, 10, 1)", maze_tables(1), (15, 3, 9, 1), 15),
        _row("maze tables (1404, 4, 10, 3)", maze_tables(3), (15, 3, 9, 1), 15),
        _row("low rank + 5 % noise (36864, 25, 10, 2)", large_tensor(), (50, 10, 9, 1), 1),
    ]


def maze_tables(n_agents: int) -> FloatArray:
    """Return the Q-tables after each of the episodes 41 to 50 of Dyna-H on maze 0: (1404, 4, 10, n_agents)."""
    agent = DynaH(random_maze(seed=0), n_agents=n_agents, seed=0).learn(episodes=40)
    return np.stack([np.moveaxis(agent.learn(episodes=1).q, 0, 2) for _ in range(10)], axis=2)


def large_tensor() -> FloatArray:
    """Return a tensor of the size of the robot rescue's tables."""
    rng = np.random.default_rng(0)
    tensor: FloatArray = rng.normal(size=(50, 10, 9, 1))
    for mode, size in enumerate((36864, 25, 10, 2)):
        factor = np.linalg.qr(rng.normal(size=(size, tensor.shape[mode])))[0]
        tensor = np.moveaxis(np.tensordot(factor, tensor, axes=(1, mode)), 0, mode)
    noise = rng.normal(size=tensor.shape)
    noise *= 0.05 * np.linalg.norm(tensor) / np.linalg.norm(noise)
    return np.ascontiguousarray(tensor + noise)


def _row(what: str, tensor: FloatArray, ranks: Ranks, repeats: int) -> Row:
    ours = tucker(tensor, ranks)
    theirs = tucker_to_tensor(tensorly_tucker(tensor, rank=list(ranks)))
    their_fit = 1 - float(np.linalg.norm(tensor - theirs) / np.linalg.norm(tensor))
    if ours.fit < their_fit - 1e-4:
        raise RuntimeError(f"{what}: our fit {ours.fit:.6f} is worse than TensorLy's {their_fit:.6f}")
    return compare(
        what,
        f"fit {ours.fit:.4f}",
        lambda: tucker(tensor, ranks),
        f"TensorLy (fit {their_fit:.4f})",
        lambda: tensorly_tucker(tensor, rank=list(ranks)),
        repeats=repeats,
    )
