"""What the command line may be given: right texts of each argument, and wrong ones among them."""

import contextlib
import io
from collections.abc import Mapping, Sequence
from typing import Any

import pytest

from tests.calls.target import Make, Target, these
from tuckerl import cli
from tuckerl.checks import shown
from tuckerl.errors import LONGEST_MESSAGE, ParameterError

_SETTINGS = these(
    *("alpha=0.2", "epsilon=Linear(1, 0, 3)", "gamma=1", "ties=first", "initial_q=1.0", "alpha=Harmonic(0.5, 3)"),
    *(
        "alpha=",
        "=1",
        "alpha",
        "alpha=nan",
        "alpha=1e999",
        "alpha=[[1],[1,2]]",
        "alpha=(",
        "seed=1",
        "n_agents=2",
        "env=x",
    ),
    *("epsilon=Linear(1,0)", "epsilon=Linear(1,0,x)", "epsilon=Foo(1)", "epsilon=Linear(start=1,start=2)", "policy=x"),
    *("ranks=1,2", "ranks=1,1,1,1", "every=0", "every=2", "bins=3", "heuristic=1", "lambda_=2", "planning_steps=-1"),
    *("initial_q=1e308", "initial_q=None", "compiled=no", "compiled=False", "alpha={1:2}", "alpha=" + "9" * 5000),
    *("alpha=" + "(" * 300, "a\0b=1", "alpha='x'", "weights=paper", "share=nobody", "tensor_step=1", "base.alpha=0.2"),
    *("candidate.gamma=2", "nobody.alpha=1", "__class__=1", "self=1", "epsilon=Linear(1,0,9**9**9)", "alpha=1j"),
)
_ENV_SETTINGS = these(
    *(
        "rows=5",
        "goal=(4, 4)",
        "render_mode=ansi",
        "is_slippery=False",
        "rows=0",
        "rows=x",
        "x=1",
        "rows",
        "rows=10**9",
    ),
    *("map_name=9x9", "render_mode=x", "max_episode_steps=5", "id=x", "walls=[[1]]", "disable_env_checker=1"),
)
_ALGORITHMS = these("q-learning", "tq-learning", "sarsa", "sarsa-lambda", "dyna-h", "team-q", "sarsa")
_ENVIRONMENTS = these("FrozenLake-v1", "tuckerl/DynaMaze-v0", "tuckerl/RobotRescue-v0", "CartPole-v1", "tests:x", "x")
_COUNTS = these("1", "2", "3")
_FLAG = these("")
_NUMBERS = these("0", "1", "7")


def _right(target: str, positional: int, arguments: Mapping[str, Sequence[Make]], required: int) -> Target:
    def call(_: Any, **given: Any) -> None:
        texts = {name: value if isinstance(value, str) else shown(value) for name, value in given.items()}
        places = list(arguments)[:positional]
        words = [*target.split(), *(texts.pop(name) for name in places if name in texts)]
        for name, text in texts.items():
            option = f"--{name.replace('_', '-')}"
            words += [option] if arguments.get(name) is _FLAG and not text else [option, text]
        _run(words)

    return Target(f"tuckerl {target}", call, arguments, required, check=lambda result: None, may_last=True)


def _run(words: list[str]) -> None:
    """Give a command line, and raise its one sentence where it refuses that."""
    said = io.StringIO()
    with contextlib.redirect_stderr(said), pytest.raises(SystemExit) as end:
        cli.main(words)
    message, status = said.getvalue().rpartition("tuckerl: ")[2].strip(), end.value.code
    if status == cli.INTERRUPTED:
        raise KeyboardInterrupt
    assert status in (0, 2), f"{status}: {message:.300}"
    if status == 2:
        assert 0 < len(message) <= LONGEST_MESSAGE, f"{len(message)} characters: {message:.100}"
        raise ParameterError(message)


def _studied() -> dict[str, dict[str, Sequence[Make]]]:
    places = these("good.tuckerl", ".", "missing.toml", "", "table.npy")
    return {
        "run": {"file": places, "out": these("studied"), "workers": _NUMBERS, "runs": _NUMBERS, "yes": _FLAG},
        "status": {"place": places},
        "resume": {"folder": places, "workers": _NUMBERS},
        "report": {"folder": places},
        "export": {"folder": places, "format": these("csv", "parquet", "x"), "out": these("a.csv", "a.x", "")},
    }


def command_lines() -> list[Target]:
    """Return the commands."""
    learned: dict[str, Sequence[Make]] = {
        "algorithm": _ALGORITHMS,
        "env": _ENVIRONMENTS,
        "episodes": _COUNTS,
        "out": these("trained"),
        "steps": _COUNTS,
        "agents": _COUNTS,
        "set": _SETTINGS,
        "env_set": _ENV_SETTINGS,
        "quantile_bins": these("3", "2,2,2,2", "2,x", "0", ",", ""),
        "seed": _NUMBERS,
        "checkpoint": _COUNTS,
        "evaluate": _NUMBERS,
        "resume": _FLAG,
        "overwrite": _FLAG,
    }
    compared: dict[str, Sequence[Make]] = {
        "base": _ALGORITHMS,
        "candidate": _ALGORITHMS,
        "env": _ENVIRONMENTS,
        "runs": these("0", "x"),
        "episodes": _COUNTS,
        "workers": these("1"),
        "out": these("compared"),
        "agents": _COUNTS,
        "set": _SETTINGS,
        "env_set": _ENV_SETTINGS,
        "measure": these("return", "steps", "final", "x"),
        "seed": _NUMBERS,
        "overwrite": _FLAG,
    }
    tuned: dict[str, Sequence[Make]] = {
        "algorithm": _ALGORITHMS,
        "env": _ENVIRONMENTS,
        "trials": these("0", "x"),
        "search": these("alpha=0:1", "alpha=1:0.5", "alpha=0.1:1:log", "x=1:2", "alpha=", "every=2:x", "share=max,min"),
        "set": _SETTINGS,
        "env_set": _ENV_SETTINGS,
        "agents": _COUNTS,
        "batch": _NUMBERS,
        "rungs": these("1,2", "2,1", "x", "", "0"),
        "episodes": _COUNTS,
        "measure": these("return", "steps", "final", "x"),
        "workers": these("1"),
        "out": these("tuned"),
        "seed": _NUMBERS,
    }
    files = these("good.tuckerl", "bad.tuckerl", "missing.tuckerl", ".", "", "table.npy", "objects.npy", "not.npz")
    return [
        *[_right("train", 2, learned, 4)] * 3,
        _right("compare", 2, compared, 7),
        _right("tune", 2, tuned, 3),
        _right("evaluate", 1, {"file": files, "episodes": _COUNTS, "seed": _NUMBERS, "env": _ENVIRONMENTS}, 2),
        _right(
            "show",
            1,
            {
                "file": files,
                "out": these("shown"),
                "shape": these("2,2", "4,1", "3,3", "x", "2,2,2"),
                "ranks": these("1,1,1,1", "2,2,2,2", "0,0,0,0", "1"),
                "env": _ENVIRONMENTS,
                "env_set": _ENV_SETTINGS,
            },
            2,
        ),
        *(_right(f"study {name}", 1, arguments, 1) for name, arguments in _studied().items()),
        _right("list", 1, {"what": these("algorithms", "environments", "sarsa", "nothing", "")}, 0),
        _right(
            "reproduce",
            1,
            {
                "scenario": these("dyna-maze", "nothing", ""),
                "runs": these("0", "x", "-1"),
                "out": these("good.tuckerl"),
            },
            3,
        ),
        _right("nothing", 0, {"help": _FLAG, "x": _NUMBERS}, 0),
    ]
