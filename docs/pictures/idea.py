"""Draw the pictures of docs/idea.md: ``python docs/pictures/idea.py`` writes them beside this file.

What they show is computed: three agents learn on a maze, and their tables are decomposed as the tensor step does it.
"""

from pathlib import Path

import matplotlib as mpl

mpl.use("agg")

import matplotlib.pyplot as plt  # the backend is chosen first
import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import FancyArrowPatch, Polygon, Rectangle

import tuckerl

HERE = Path(__file__).parent
BLUE, ORANGE, GREEN, GREY = "#0072B2", "#E69F00", "#009E73", "0.45"
ACTIONS = ("up", "down", "left", "right")
EVERY, AGENTS = 10, 3


def tables() -> np.ndarray:
    """Return the (state, action, episode, agent) tables of the first window of three agents."""
    agents = [tuckerl.QLearning(tuckerl.sutton_maze(), alpha=0.5, seed=seed) for seed in range(AGENTS)]
    window = []
    for _ in range(EVERY):
        for agent in agents:
            agent.learn(1)
        window.append(np.stack([agent.q[0] for agent in agents], axis=-1))
    return np.stack(window, axis=2)


def save(figure: plt.Figure, name: str) -> None:
    """Write a picture whose bytes depend on nothing but what it shows."""
    figure.savefig(HERE / f"{name}.png", dpi=130, bbox_inches="tight", metadata={"Software": None})
    plt.close(figure)


def bare(axes: Axes) -> None:
    """Leave nothing of an axes but what is drawn in it."""
    axes.set_aspect("equal")
    axes.axis("off")


def note(axes: Axes, x: float, y: float, text: str, **looks: object) -> None:
    """Write centred text."""
    axes.text(x, y, text, **{"ha": "center", "va": "center", "fontsize": 9, **looks})


def draw_tensor(tensor: np.ndarray) -> None:
    """Draw each agent's tables of the window as a stack of sheets."""
    figure, axes = plt.subplots(figsize=(8.4, 3.6))
    n_states, n_actions = 18, tensor.shape[1]  # the first rows are enough to see what a table is
    low, wide = tensor.min(), 1.6
    for agent in range(AGENTS):
        left = agent * 6.0
        for sheet, episode in enumerate(reversed((0, 3, 6, 9))):
            shift = 0.55 * (3 - sheet)
            table = tensor[:n_states, :, episode, agent]
            box = (left + shift, left + shift + wide, shift * 0.75, 4 + shift * 0.75)
            axes.imshow(table, cmap="cividis", vmin=low, vmax=0, extent=box, zorder=sheet * 2, interpolation="nearest")
            edge = Rectangle((box[0], box[2]), wide, 4, fill=False, edgecolor="white", lw=1.5, zorder=sheet * 2 + 1)
            axes.add_patch(edge)
        note(axes, left + wide / 2, -0.45, f"agent {agent}", fontweight="bold")
    note(axes, -0.45, 2, f"states ({tensor.shape[0]})", rotation=90)
    note(axes, wide / 2, -1.0, f"actions ({n_actions})")
    axes.add_patch(FancyArrowPatch((1.75, -0.1), (3.5, 1.2), arrowstyle="->", mutation_scale=12, color="0.2"))
    note(axes, 2.85, 0.3, f"episodes ({EVERY})", ha="left", zorder=20)
    axes.set_xlim(-1, 15.8)
    axes.set_ylim(-1.3, 5.6)
    bare(axes)
    bar = figure.colorbar(axes.images[0], ax=axes, shrink=0.6, pad=0.02)
    bar.set_label("Q(s, a)")
    save(figure, "tensor")


def _matrix(axes: Axes, corner: tuple[float, float], size: tuple[float, float], colour: str, cuts: int = 1) -> None:
    """Draw a factor, its columns told apart."""
    axes.add_patch(Rectangle(corner, *size, facecolor=colour, alpha=0.35, edgecolor=colour, lw=1.8))
    for cut in range(1, cuts):
        x = corner[0] + size[0] * cut / cuts
        axes.plot([x, x], [corner[1], corner[1] + size[1]], color=colour, lw=0.8)


def _cube(axes: Axes, corner: tuple[float, float], size: tuple[float, float, float], colour: str) -> None:
    """Draw a box in three dimensions."""
    x, y = corner
    wide, high, deep = size
    dx, dy = 0.6 * deep, 0.45 * deep
    faces = (
        [(x, y), (x + wide, y), (x + wide, y + high), (x, y + high)],
        [(x, y + high), (x + wide, y + high), (x + wide + dx, y + high + dy), (x + dx, y + high + dy)],
        [(x + wide, y), (x + wide + dx, y + dy), (x + wide + dx, y + high + dy), (x + wide, y + high)],
    )
    for face, alpha in zip(faces, (0.35, 0.2, 0.5), strict=True):
        axes.add_patch(Polygon(face, facecolor=colour, alpha=alpha, edgecolor="none"))
        axes.add_patch(Polygon(face, fill=False, edgecolor="0.25", lw=1.2))


def draw_tucker() -> None:
    """Draw the shapes of the decomposition."""
    figure, axes = plt.subplots(figsize=(8.6, 3.4))
    _cube(axes, (0, 0), (1.6, 3.6, 1.6), "0.55")
    note(axes, 0.8, 1.8, "tables\n(S, A, E, N)")
    note(axes, 3.35, 1.8, "≈", fontsize=20)
    _cube(axes, (4.2, 1.1), (1.0, 1.4, 0.9), "0.55")
    note(axes, 4.7, 1.8, "core")
    factors = (
        ("S_p", "states", "S x r$_1$", 1.1, 3.6, GREY, 4, ""),
        ("A_p", "actions", "A x r$_2$", 0.9, 1.6, BLUE, 3, "row norms:\nω, how fast each\naction learns"),
        ("E_p", "episodes", "E x r$_3$", 1.1, 2.1, GREY, 4, ""),
        ("Ag_p", "agents", "N x r$_4$", 0.4, 1.3, ORANGE, 1, "row norms:\nwhose table\nall copy"),
    )
    x = 6.7
    for name, mode, size, wide, high, colour, cuts, use in factors:
        note(axes, x - 0.45, 1.8, r"$\times$", fontsize=13)
        _matrix(axes, (x, 1.8 - high / 2), (wide, high), colour, cuts)
        note(axes, x + wide / 2, 4.45, f"{mode}\n${name.replace('_p', '_{p}')}$", fontweight="bold")
        note(axes, x + wide / 2, 3.82, size, fontsize=8)
        note(axes, x + wide / 2, -0.2, use, fontsize=8.5, color="0.1")
        x += wide + 1.5
    axes.set_xlim(-0.2, x - 0.6)
    axes.set_ylim(-0.9, 5)
    bare(axes)
    save(figure, "tucker")


def _bars(axes: Axes, values: np.ndarray, colour: str, title: str, top: float) -> None:
    axes.bar(ACTIONS, values, color=colour, width=0.6, edgecolor="0.2", lw=0.8)
    for place, value in enumerate(values):
        axes.text(place, value + 0.02 * top, f"{value:.2f}", ha="center", va="bottom", fontsize=8)
    axes.set_ylim(0, top)
    axes.set_title(title, fontsize=10)
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(labelsize=8)


def draw_omega(tensor: np.ndarray) -> None:
    """Draw the loadings of the actions, omega, and the agents' norms."""
    found = tuckerl.tucker(tensor, (15, 3, 9, 1))
    factor = found.factors[1]
    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(9, 2.9), width_ratios=(1, 1.2, 1))
    largest = np.abs(factor).max()
    image = left.imshow(factor, cmap="PuOr", vmin=-largest, vmax=largest)
    for row, column in np.ndindex(factor.shape):
        dark = abs(factor[row, column]) > 0.7 * largest
        number = f"{factor[row, column]:.2f}"
        left.text(column, row, number, ha="center", va="center", fontsize=8, color="white" if dark else "black")
    left.set_yticks(range(4), ACTIONS, fontsize=8)
    left.set_xticks(range(3), ("column 1", "column 2", "column 3"), fontsize=8)
    left.set_title("the action factor $A_p$", fontsize=10)
    figure.colorbar(image, ax=left, shrink=0.8).ax.tick_params(labelsize=7)
    _bars(middle, tuckerl.action_weights(factor), BLUE, "ω: norm of each row / norm of $A_p$", 0.75)
    norms = np.linalg.norm(found.factors[3], axis=1)
    chosen = int(np.argmax(norms))
    bars = right.bar([f"agent {n}" for n in range(AGENTS)], norms, color=ORANGE, width=0.6, edgecolor="0.2", lw=0.8)
    bars[chosen].set_hatch("//")
    for place, value in enumerate(norms):
        right.text(place, value + 0.01, f"{value:.3f}", ha="center", va="bottom", fontsize=8)
    right.set_ylim(0, 0.85)
    right.text(chosen, norms[chosen] + 0.08, "copied", ha="center", va="bottom", fontsize=8, fontweight="bold")
    right.set_title("norm of each row of $Ag_p$", fontsize=10)
    right.spines[["top", "right"]].set_visible(False)
    right.tick_params(labelsize=8)
    figure.tight_layout()
    save(figure, "omega")


def draw_controls(tensor: np.ndarray) -> None:
    """Draw the weights of one window under the paper's rule and its controls."""
    weights = tuckerl.action_weights(tuckerl.tucker(tensor, (15, 3, 9, 1)).factors[1])
    dealt = np.random.default_rng(3).permutation(weights)
    shown = (
        (np.ones(4), "0.8", "none\nthe plain algorithm"),
        (weights, BLUE, "paper\nfrom the tensor"),
        (np.full(4, 0.5), ORANGE, "constant\nas small, the same for all"),
        (dealt, GREEN, "permuted\nthe paper's, to random actions"),
    )
    figure, panels = plt.subplots(1, 4, figsize=(10.4, 2.7), sharey=True)
    for axes, (values, colour, title) in zip(panels, shown, strict=True):
        _bars(axes, values, colour, title, 1.15)
        axes.title.set_fontsize(9)
        axes.axhline(0.5, color="0.2", lw=0.9, ls="--")
    panels[0].set_ylabel("weight of the learning rate", fontsize=8)
    figure.tight_layout()
    save(figure, "controls")


def draw_windows() -> None:
    """Draw what happens when: episodes, windows, steps."""
    figure, axes = plt.subplots(figsize=(8.6, 2.7))
    for window in range(3):
        left = window * 6
        for agent in range(AGENTS):
            for episode in range(5):
                corner = (left + episode, 2.2 - agent)
                axes.add_patch(Rectangle(corner, 0.85, 0.7, facecolor=BLUE, alpha=0.25, edgecolor=BLUE, lw=1))
        weights = "" if window == 0 else rf"$\omega_{window}$"
        note(axes, left + 2.4, 3.5, f"window {window + 1}: rate $\\alpha$ {weights}", fontweight="bold")
        axes.add_patch(Rectangle((left + 5.05, 0.2), 0.5, 2.7, facecolor=ORANGE, alpha=0.6, edgecolor="0.2", lw=1))
        note(axes, left + 5.3, 1.55, "tensor step", rotation=90, fontsize=8)
    for agent in range(AGENTS):
        note(axes, -0.9, 2.55 - agent, f"agent {agent}")
    axes.add_patch(FancyArrowPatch((0, -0.25), (17.4, -0.25), arrowstyle="->", mutation_scale=12, color="0.2"))
    note(axes, 8.5, -0.75, "episodes (here 5 in a window; the paper has 10)")
    axes.set_xlim(-1.9, 17.7)
    axes.set_ylim(-1.1, 3.9)
    bare(axes)
    save(figure, "windows")


def main() -> None:
    """Draw them all."""
    tensor = tables()
    draw_tensor(tensor)
    draw_tucker()
    draw_omega(tensor)
    draw_controls(tensor)
    draw_windows()


if __name__ == "__main__":
    main()
