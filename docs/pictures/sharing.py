"""Study when agents should share, and draw and write what came out into docs/when-to-share.md.

``python -m docs.pictures.sharing`` plays all runs of ``sharing-settings.json`` (some ten minutes of one core), which
says all that was fixed before, and writes, beside this file, ``sharing.json`` and ``sharing.png``; with the names of
problems it plays only these, and with ``--draw`` it draws what came out before. The base is tuned on the grid by its
mean over the tuning runs; then every variant plays with the tuned base's parameters on the test runs, whose seeds and
mazes are other ones. Equal runs have equal seeds.
"""

import gc
import itertools
import json
import re
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("agg")

import matplotlib.pyplot as plt  # the backend is chosen first
import numpy as np
from docs.pictures.layers import table_pattern

import tuckerl
from tuckerl.studies.algorithms import named_algorithm
from tuckerl.studies.scenarios import SCENARIOS
from tuckerl.studies.statistics import paired_difference
from tuckerl.types import FloatArray

HERE = Path(__file__).parent
PAGE = HERE.parent / "when-to-share.md"
SETTINGS, RESULTS = HERE / "sharing-settings.json", HERE / "sharing.json"
VARIANTS = {
    "visits": "by visits",
    "mean": "the mean",
    "paper": "the paper's rule",
    "constant": "its constant control",
}

Settings = dict[str, Any]


def worlds(environment: Settings) -> Callable[[int], Any]:
    """Return what makes the world of a run by its number: mazes differ, others are one."""
    if "maze" in environment:
        return lambda number: tuckerl.random_maze(seed=number, deviation=environment["maze"])
    if "scenario" in environment:
        only = SCENARIOS[environment["scenario"]].problem(0)
    else:
        only = tuckerl.QLearning(environment["id"]).problem
    return lambda number: only


def tensor_step(variant: str, every: int, paper: Settings) -> tuckerl.TensorStep | None:
    """Return the step of a variant; "base" has none."""
    if variant == "base":
        return None
    if variant in ("visits", "mean"):
        return tuckerl.TensorStep(every, weights="none", share=variant)
    return tuckerl.TensorStep(every, weights=variant, **paper)


def played(
    settings: Settings, name: str, phase: str, variant: str, parameters: Settings, world: Callable[[int], Any]
) -> FloatArray:
    """Return what is measured, the mean over agents and episodes, of each run of a phase, (runs,)."""
    problem, place = settings["problems"][name], list(settings["problems"]).index(name)
    learner = named_algorithm(problem["algorithm"]).learner
    step = tensor_step(variant, settings["every"], problem["paper"])
    values = []
    for run in range(settings["runs"][phase]):
        seed = np.random.SeedSequence(settings["seeds"][phase], spawn_key=(place, run))
        n_agents = 1 if step is None else settings["agents"]
        made = learner(
            world(settings["first maze"][phase] + run), **parameters, n_agents=n_agents, tensor_step=step, seed=seed
        )
        made.learn(problem["episodes"])
        if made.diverged_at is not None:
            raise RuntimeError(f"a table of {name} diverged in run {run}")
        if run % 20 == 0:
            gc.collect()  # learners refer to themselves, and their large tables do not count for when this is done
        values.append(float((made.steps if problem["measure"] == "steps" else made.returns).mean()))
    return np.array(values)


def study(settings: Settings, names: Sequence[str]) -> Iterator[tuple[str, Settings]]:
    """Give, for each problem of these names, what was tuned and by how much each variant is better than the base."""
    for place, (name, problem) in enumerate(settings["problems"].items()):
        if name not in names:
            continue
        sign, world = 1.0 if problem["larger_is_better"] else -1.0, worlds(problem["environment"])
        grid = []
        for point in itertools.product(*problem["grid"].values()):
            tried = dict(zip(problem["grid"], point, strict=True))
            mean = played(settings, name, "tuning", "base", problem["parameters"] | tried, world).mean()
            grid.append(tried | {"mean": float(mean)})
        best = max(grid, key=lambda tried: sign * tried["mean"])
        tuned = {parameter: best[parameter] for parameter in problem["grid"]}
        base = played(settings, name, "test", "base", problem["parameters"] | tuned, world)
        result: Settings = {"tuned": tuned, "grid": grid, "runs": base.size, "base": float(base.mean()), "variants": {}}
        for number, variant in enumerate(VARIANTS):
            values = played(settings, name, "test", variant, problem["parameters"] | tuned, world)
            rng = np.random.default_rng([settings["seeds"]["test"], place, number])
            found = paired_difference(base, values, sign, 0, rng)
            percents = {part: 100 * getattr(found, part) for part in ("mean", "low", "high")}
            result["variants"][variant] = {"measured": float(values.mean()), **percents}
        yield name, result


def table(results: Settings) -> str:
    """Return a row for each problem: by how many percent each variant is better than the tuned base."""
    lines = ["| problem | base | " + " | ".join(VARIANTS.values()) + " |", "|---" * (2 + len(VARIANTS)) + "|"]
    for name, result in results.items():
        cells = [_interval(found["mean"], found["low"], found["high"]) for found in result["variants"].values()]
        tuned = ", ".join(f"{parameter} {value:g}" for parameter, value in result["tuned"].items())
        lines.append(f"| {name} | {result['base']:.1f} ({tuned}) | " + " | ".join(cells) + " |")
    return _with_minus(lines)


def _interval(mean: float, low: float, high: float) -> str:
    digits = 1 if abs(mean) >= 1.0 else 2
    return f"{mean:+.{digits}f} ({low:+.{digits}f} to {high:+.{digits}f})"


def signs(results: Settings) -> str:
    """Return a row for each problem: what had been found before, and whether it came out again."""
    lines = ["| problem | by visits, before | now | the paper's rule, before | now |", "|---|---|---|---|---|"]
    for name, problem in json.loads(SETTINGS.read_text("utf-8"))["problems"].items():
        cells = [name]
        for variant, before in problem["found before"].items():
            found = results[name]["variants"][variant]
            agrees = found["low"] * before > 0 and found["high"] * before > 0
            decided = found["low"] * found["high"] > 0
            words = "the same sign" if agrees else "the other sign" if decided else "not decided"
            cells += [f"{before:+g}", f"{found['mean']:+.1f}: {words}"]
        lines.append("| " + " | ".join(cells) + " |")
    return _with_minus(lines)


def _with_minus(lines: Sequence[str]) -> str:
    """Return a table's lines as text, with minus signs where numbers have hyphens."""
    return "\n".join(line if line.startswith("|---") else re.sub(r"-(?=\d)", "\N{MINUS SIGN}", line) for line in lines)


TABLES = {"sharing": table, "signs": signs}


def draw(results: Settings) -> None:
    """Draw each variant's difference with its interval, a panel for each problem."""
    figure, panels = plt.subplots(2, 3, figsize=(8.4, 4.4), layout="constrained")
    looks = {"visits": ("o", "black", "0.0"), "mean": ("s", "white", "0.0"), "paper": ("^", "0.6", "0.35")}
    looks["constant"] = ("v", "white", "0.55")
    for axes, (name, result) in zip(panels.flat, results.items(), strict=True):
        for place, variant in enumerate(VARIANTS):
            found, (marker, fill, colour) = result["variants"][variant], looks[variant]
            axes.plot([found["low"], found["high"]], [-place, -place], color=colour, linewidth=1.5)
            axes.plot(found["mean"], -place, marker, color=colour, markerfacecolor=fill, markersize=7)
        axes.axvline(0.0, color="0.5", linewidth=1, linestyle="dotted", zorder=0)
        axes.set_yticks(range(0, -len(VARIANTS), -1), VARIANTS.values() if axes in panels[:, 0] else [])
        axes.set_ylim(0.6 - len(VARIANTS), 0.6)
        axes.set_title(f"{name}, n = {result['runs']}", fontsize=9, loc="left")
        axes.tick_params(labelsize=8)
        axes.spines[["top", "right"]].set_visible(False)
    figure.supxlabel("percent better than the tuned base with one agent (95 % interval)", fontsize=9)
    figure.savefig(HERE / "sharing.png", dpi=130, metadata={"Software": None})
    plt.close(figure)


def main(names: Sequence[str]) -> None:
    """Play the problems of these names, draw, and write the page's tables."""
    results = json.loads(RESULTS.read_text("utf-8")) if RESULTS.exists() else {}
    settings = json.loads(SETTINGS.read_text("utf-8"))
    warnings.simplefilter("ignore")  # ranks that a window clips, and what is not a study's to say
    for name, result in study(settings, names):
        results[name] = result
        sys.stderr.write(f"{name}: {json.dumps(result['tuned'])} {json.dumps(result['variants'])}\n")
        RESULTS.write_text(json.dumps(results, indent=1) + "\n", "utf-8")
    results = {name: results[name] for name in settings["problems"]}
    draw(results)
    page = PAGE.read_text("utf-8")
    for name, written in TABLES.items():
        page = table_pattern(name).sub(f"\n{written(results)}\n\n", page)
    PAGE.write_text(page, "utf-8")


if __name__ == "__main__":
    asked = sys.argv[1:]
    main([] if asked == ["--draw"] else asked or list(json.loads(SETTINGS.read_text("utf-8"))["problems"]))
