"""Draw the pictures of docs/inspect.md and solve.md: ``python docs/pictures/inspection.py`` writes them here."""

from pathlib import Path

import tuckerl
from tuckerl.reports.inspect import inspect_learner, inspection_figures

HERE = Path(__file__).parent
SHOWN = ("policy", "copied", "state-loadings")


def main() -> None:
    """Let three agents learn on Sutton's maze, and draw what is in them."""
    step = tuckerl.TensorStep(every=10, ranks=(5, 3, 9, 1), share="best")
    maze = tuckerl.sutton_maze()
    agent = tuckerl.QLearning(maze, alpha=0.3, n_agents=3, tensor_step=step, seed=0).learn(episodes=200)
    for picture in inspection_figures(inspect_learner(agent)):
        if picture.name in SHOWN:
            (HERE / f"inspect-{picture.name}.png").write_bytes(picture.png)
    young = tuckerl.QLearning(maze, alpha=0.3, seed=0).learn(episodes=50)
    (picture,) = (one for one in inspection_figures(inspect_learner(young)) if one.name == "optimum")
    (HERE / "solve-optimum.png").write_bytes(picture.png)


if __name__ == "__main__":
    main()
