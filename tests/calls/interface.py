"""What may be called, with right values of each argument, and what makes a result sound."""

import shutil
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

import tuckerl
from tests.calls.command_line import command_lines
from tests.calls.target import ONLY_WRONG, Make, Target, these
from tests.calls.values import learner, mdp, sound
from tuckerl.environments.cart_pole import CartPoleEnv
from tuckerl.environments.dyna_maze import DynaMazeEnv
from tuckerl.environments.robot_rescue_env import RobotRescueEnv
from tuckerl.environments.robot_rescue_map import RescueMap
from tuckerl.problems.simulator import first_entry
from tuckerl.reports.inspect import inspect_learner, inspect_tensor, inspection_figures, write_inspection
from tuckerl.solving.solve import METHODS
from tuckerl.spaces.encoder import space_encoder
from tuckerl.testing import check_problem
from tuckerl.training.learner import Learner

# Sound results


def learns(agent: Learner) -> None:
    """Refuse a learner that cannot be used."""
    if agent.tensor_step is not None and agent.tensor_step.every > 50:
        return
    agent.learn(3)
    assert agent.diverged_at is not None or np.isfinite(agent.q).all()
    assert agent.episodes >= 1 or agent.diverged_at == 0
    assert np.isfinite(agent.alpha if isinstance(agent.alpha, float) else 0.0)
    step = agent.tensor_step
    is_data = agent.problem.is_data and not (step is not None and (callable(step.weights) or callable(step.share)))
    if agent.diverged_at is None and is_data:
        agent.save("kept.tuckerl")
        again = type(agent).load("kept.tuckerl")
        np.testing.assert_array_equal(again.q, agent.q)
        assert repr(again.parameters) == repr(agent.parameters)


def plays(problem: Any) -> None:
    """Refuse a problem that cannot be learned."""
    problem = problem.to_mdp() if isinstance(problem, tuckerl.Maze) else problem
    if (problem.max_episode_steps or 10**6) > 5000:
        problem = problem.with_time_limit(20)
    learns(tuckerl.QLearning(problem, seed=0))


def simulates(simulator: Any) -> None:
    """Refuse a simulator that cannot be learned; of other functions, the compiler says what is wrong."""
    if {*vars(simulator.functions).values()} <= {begin, move, row, first_entry}:
        plays(simulator)


def steers(policy: Any) -> None:
    """Refuse a policy or tensor step that a learner cannot use."""
    name = "tensor_step" if isinstance(policy, tuckerl.TensorStep) else "policy"
    agent = tuckerl.QLearning(mdp(), seed=0, n_agents=2, **{name: policy})
    if name == "policy" or policy.every <= 50:
        agent.learn(2 if name == "policy" else policy.every)
    learns(agent)


def runs(schedule: Any) -> None:
    """Refuse a schedule whose numbers are none."""
    values = schedule.values(5)
    assert ((values >= 0.0) & (values < np.inf)).all(), values
    policy = {"epsilon": schedule} if schedule.highest <= 1.0 else {"policy": tuckerl.UCB(schedule)}
    tuckerl.QLearning(mdp(), **policy, seed=0).learn(2)


def follows(callback: Any) -> None:
    """Refuse a callback that cannot be used."""
    learner().learn(4, callbacks=[callback])


def encodes(encoder: Any) -> None:
    """Refuse an encoder that does not know its own members."""
    assert encoder.n >= 1
    for number in {0, encoder.n - 1}:
        assert encoder.encode(encoder.decode(number)) == number


# Functions for simulators, weights and shares


def begin(parameters: Any, state: Any, rng: Any) -> None:
    """Put the first state."""
    state[:] = 0.0


def move(parameters: Any, state: Any, action: int, rng: Any) -> tuple[float, bool]:
    """Walk to and fro."""
    state[0] = min(max(state[0] + 2 * action - 1, 0.0), 3.0)
    return -1.0, state[0] == 3.0


def row(parameters: Any, state: Any) -> int:
    """Return the row."""
    return int(state[0])


# Environments


def lake(**keywords: Any) -> gymnasium.Env[Any, Any]:
    """Return a small lake."""
    return gymnasium.make("FrozenLake-v1", max_episode_steps=10, **keywords)


def pole() -> gymnasium.Env[Any, Any]:
    """Return what needs bins."""
    return gymnasium.make("CartPole-v1", max_episode_steps=10)


def rescue() -> Any:
    """Return two robots."""
    return RobotRescueEnv(max_cycles=6)


BINS: list[Make] = [*these(2, (2, 2, 2, 2), (1, 3, 1, 2)), lambda: [np.array([0.0]), 2, [0.0, 0.1], 1]]
COUNTS, FLAGS, SEEDS = these(1, 2, 3), these(True, False), [*these(0, 7, None), lambda: np.random.SeedSequence(3)]
PATHS: list[Make] = [
    *these("kept.tuckerl", "good.tuckerl"),
    lambda: Path("good.tuckerl"),
    lambda: Path("other.tuckerl"),
]
STEPS: list[Make] = [
    lambda: None,
    lambda: tuckerl.TensorStep(2, (2, 2, 2, 1)),
    lambda: tuckerl.TensorStep(1, (1, 1, 1, 1)),
]
POLICIES: list[Make] = [lambda: None, tuckerl.Greedy, lambda: tuckerl.EpsilonGreedy(0.3, 0.9)]
NUMBERS: list[Make] = [*these(0.5, 0.1, 1.0), lambda: tuckerl.Linear(1.0, 0.1, 5), lambda: tuckerl.Harmonic(0.5, 3.0)]
NAMES = [*these(None, ("left", "right"))]
ENVIRONMENTS: list[Make] = [mdp, mdp, mdp, lake, lambda: lake, lambda: tuckerl.random_maze(5, 5, goal=(4, 4))]

_COMMON: dict[str, Sequence[Make]] = {
    "env": ENVIRONMENTS,
    "alpha": NUMBERS,
    "gamma": these(0.9, 1.0, 0.0),
    "epsilon": NUMBERS,
    "epsilon_decay": these(1.0, 0.9, 0.0),
    "ties": these("random", "first"),
    "initial_q": [*these(0.0, 1.0), lambda: np.ones((4, 2))],
    "n_agents": COUNTS,
    "bootstrap_terminal": FLAGS,
    "tensor_step": STEPS,
    "seed": SEEDS,
    "bins": [*these(None), *BINS],
    "policy": POLICIES,
    "compiled": these("auto", True, False),
}
_TRACES: dict[str, Sequence[Make]] = {
    "lambda_": these(0.9, 0.0, 1.0),
    "trace": these("replacing", "accumulating"),
    "carry_trace": FLAGS,
}
_PLANS: dict[str, Sequence[Make]] = {
    "planning_steps": these(0, 5),
    "heuristic": [*these(None), lambda: np.arange(4.0)],
    "search_control": these("trajectory", "restart", "random"),
}
_TEAM: dict[str, Sequence[Make]] = {
    "cut_traces": FLAGS,
    "exploration": these("independent", "joint"),
    "team_reward": these("mean", "sum"),
}
_AHEAD: dict[str, Sequence[Make]] = {"n": these(1, 3, 1_000_000)}
_LEARNERS: list[tuple[Any, dict[str, Sequence[Make]]]] = [
    (tuckerl.QLearning, {}),
    (tuckerl.Sarsa, {}),
    (tuckerl.SarsaLambda, _TRACES),
    (tuckerl.WatkinsQLambda, _TRACES),
    (tuckerl.TrueOnlineSarsaLambda, {"lambda_": _TRACES["lambda_"]}),
    (tuckerl.HAQL, {"heuristic": _PLANS["heuristic"], "xi": NUMBERS, "eta": these(0.5, 1, 10.0)}),
    (tuckerl.RLearning, {"beta": NUMBERS, "gamma": these(1.0)}),
    (tuckerl.DynaH, _PLANS),
    (tuckerl.DynaQ, {"planning_steps": these(0, 5)}),
    (tuckerl.DynaQPlus, {"planning_steps": these(0, 5), "kappa": these(0.0, 0.1)}),
    (tuckerl.PrioritizedSweeping, {"planning_steps": these(1, 5), "theta": these(0.0, 0.1)}),
    (tuckerl.RMax, {"r_max": these(None, 10.0), "m": these(1, 2), "tol": these(1e-6), "gamma": these(0.9, 0.0)}),
    (tuckerl.TeamQ, _TRACES | _TEAM | {"env": [rescue, lambda: rescue, mdp]}),
    (tuckerl.ExpectedSarsa, {}),
    (tuckerl.DoubleQLearning, {}),
    (tuckerl.NStepSarsa, _AHEAD),
    (tuckerl.TreeBackup, _AHEAD | {"target": these("greedy", "policy")}),
    (tuckerl.MonteCarlo, {"visits": these("first", "every"), "alpha": [*these(None), *NUMBERS]}),
]


def _constructor(kind: Any, own: dict[str, Sequence[Make]]) -> Target:
    return Target(kind.__name__, lambda _, **k: kind(**k), _COMMON | own, 1, check=learns, may_last=True)


# Assignments, of which only one argument is altered: the value.


def _assignable(kind: Any, own: dict[str, Sequence[Make]]) -> list[Target]:
    def subject() -> Any:
        env = rescue() if kind is tuckerl.TeamQ else mdp()
        return kind(env, seed=0, compiled=False if kind is tuckerl.TeamQ else "auto").learn(1)

    def assign(name: str) -> Callable[..., None]:
        return lambda agent, value: setattr(agent, name, value)

    names = [name for name in (_COMMON | own) if name != "env"]
    return [
        Target(f"{kind.__name__}.{name} = ", assign(name), {"value": (_COMMON | own)[name]}, 1, subject, after=learns)
        for name in (names if kind is tuckerl.QLearning else own)
        if name != "env"
    ]


_OBSERVATIONS: list[Make] = [*these(0, 3, np.int64(2)), lambda: np.arange(4), lambda: [0, 1]]
_METHODS: dict[str, tuple[dict[str, Sequence[Make]], int]] = {
    "learn": (
        {
            "episodes": COUNTS,
            "steps": these(None, None, None, 3),
            "callbacks": [lambda: [lambda agent: None], lambda: (tuckerl.StopOnReturn(1.0),)],
            "progress": FLAGS,
        },
        1,
    ),
    "predict": (
        {
            "observation": _OBSERVATIONS,
            "state": these(None),
            "episode_start": these(None),
            "deterministic": these(None, True, False),
            "action_masks": [*these(None, (True, False)), lambda: np.ones(2, dtype=np.int8)],
        },
        1,
    ),
    "evaluate": (
        {
            "episodes": COUNTS,
            "env": [*these(None), lambda: mdp(5)],
            "deterministic": these(None, True, False),
            "render": these(False),
            "seed": SEEDS,
        },
        0,
    ),
    "evaluate_saved": ({"path": PATHS, "episodes": COUNTS, "seed": SEEDS}, 1),
    "save": ({"path": these("kept.tuckerl")}, 1),
    "scheduled": ({"name": these("alpha", "epsilon")}, 1),
    "restore": ({"saved": these(ONLY_WRONG)}, 1),
    "change": ({"changes": [lambda: {"alpha": 0.5, "gamma": 0.5}, dict]}, 1),
}


def _method(name: str, arguments: dict[str, Sequence[Make]], required: int) -> Target:
    return Target(
        f"Learner.{name}",
        lambda agent, **k: getattr(agent, name)(**k),
        arguments,
        required,
        learner,
        after=learns,
        may_last=True,
        check=(lambda result: learns(result)) if name == "learn" else lambda result: _judged(result),
    )


def _judged(result: Any) -> None:
    if isinstance(result, tuckerl.Evaluation):
        assert np.isfinite(result.returns).all()
        assert np.isfinite(result.mean)
    else:
        sound(result)


def _solved(solution: Any) -> None:
    sound([np.nan_to_num(solution.v), solution.policy])
    assert solution.bound >= 0.0


# Environments' own methods


def _env_targets() -> list[Target]:
    def began(make: Callable[[], Any]) -> Make:
        def subject() -> Any:
            env = make()
            env.reset(seed=0)
            return env

        return subject

    kinds: dict[str, tuple[Callable[[], Any], Sequence[Make]]] = {
        "DynaMazeEnv": (lambda: DynaMazeEnv(rows=5, columns=5, goal=(4, 4)), these(0, 3, np.int64(1))),
        "CartPoleEnv": (CartPoleEnv, these(0, 20)),
        "RobotRescueEnv": (rescue, [lambda: {"robot_0": 1, "robot_1": 4}]),
        "JointEnv": (lambda: tuckerl.JointEnv(rescue()), [lambda: np.array([0, 4]), lambda: [1, 2]]),
        "SplitEnv": (lambda: tuckerl.SplitEnv(tuckerl.JointEnv(rescue())), [lambda: {"agent_0": 1, "agent_1": 2}]),
    }
    targets = []
    for name, (make, actions) in kinds.items():
        targets.append(
            Target(
                f"{name}.step", lambda env, **k: env.step(**k), {"action": actions}, 1, began(make), lambda result: None
            )
            if name not in ("RobotRescueEnv", "SplitEnv")
            else Target(
                f"{name}.step",
                lambda env, **k: env.step(**k),
                {"actions": actions},
                1,
                began(make),
                lambda result: None,
            )
        )
        reset: dict[str, Sequence[Make]] = {"seed": these(None, 3), "options": [lambda: None, dict]}
        targets.append(
            Target(f"{name}.reset", lambda env, **k: env.reset(**k), reset, 0, began(make), lambda result: None)
        )
    return targets


def _tensor() -> np.ndarray:
    return np.random.default_rng(0).normal(size=(4, 2, 3, 2))


_RANKS: list[Make] = [*these((2, 2, 2, 1), (1, 1, 1, 1), "auto", 0.9), lambda: [2, 1, 2, 2]]
_TABLE: dict[str, Sequence[Make]] = {
    "next_state": [lambda: np.array([[0, 1], [0, 2], [1, 3], [3, 3]]), lambda: [[0, 1], [0, 2], [1, 3], [3, 3]]],
    "reward": [lambda: np.ones((4, 2)), lambda: np.arange(8).reshape(4, 2)],
    "terminated": [lambda: np.array([[0, 0], [0, 0], [0, 1], [1, 1]], dtype=bool)],
    "probability": [*these(None)],
    "start": [*these(0, 2, np.int32(1)), lambda: np.full(4, 0.25)],
    "max_episode_steps": these(8, 20, None),
    "heuristic": [*these(None), lambda: np.arange(4.0)],
    "action_sizes": these(None, (2,), (1, 2)),
    "action_mask": [*these(None), lambda: np.ones((4, 2), dtype=bool)],
    "layout": these(None, (2, 2), (1, 4)),
    "action_names": NAMES,
    "state_factors": [*these(None), lambda: [("a", 2), ("b", 2)]],
}
_DRAWS: dict[str, Sequence[Make]] = {
    "next_state": [lambda: np.array([[[0, 1], [0, 2]], [[0, 1], [1, 1]]]) % 2],
    "reward": [lambda: np.ones((2, 2, 2))],
    "terminated": [lambda: np.zeros((2, 2, 2), dtype=bool)],
    "probability": [lambda: np.full((2, 2, 2), 0.5), lambda: np.array([[[0.25, 0.75]] * 2] * 2, dtype=np.float32)],
    "start": [*these(0), lambda: [0.5, 0.5]],
    "max_episode_steps": these(8),
}
_SIMULATED: dict[str, Sequence[Make]] = {
    "reset": these(begin),
    "step": these(move),
    "index": these(None, row),
    "n_states": these(4, 5),
    "n_actions": these(2),
    "state_size": these(1, 2),
    "parameters": [*these((), (1.0, 2.0)), lambda: np.ones(3), lambda: {"a": 1.0}],
    "max_episode_steps": these(8, None),
    "heuristic": [*these(None), lambda: np.arange(4.0)],
    "layout": these(None, (2, 2)),
    "action_names": NAMES,
    "state_factors": [*these(None), lambda: [("a", 2), ("b", 2)]],
}
_SPACES: list[Make] = [
    *(lambda: spaces.Box(-1, 1, (4,)), lambda: spaces.Box(-1.0, 1.0, (2, 2), np.float64)),
    *(lambda: pole().observation_space,),
]
_MEMBERS: list[Make] = [lambda: np.zeros(4, dtype=np.float32), lambda: [0.1, 0.2, 0.3, 0.4]]
_CELLS, _MAZE = (
    these((0, 0), (1, 2)),
    dict[str, Sequence[Make]](
        walls=[lambda: np.zeros((4, 4), dtype=bool), lambda: [[False, True, False], [False, False, False]]],
        start=these((0, 0)),
        goal=these((1, 2), (1, 1)),
    ),
)
_EVERY = these(None, 1, 2, 4)


def _inspection() -> Any:
    return inspect_learner(learner())


def _calls(function: Callable[..., Any]) -> Callable[..., Any]:
    return lambda _, **k: function(**k)


def _written(path: Any) -> None:
    assert isinstance(path, Path)
    shutil.rmtree(path.parent, ignore_errors=True)


_STUDY = """
runs = 1
episodes = 2
[[problem]]
env = "FrozenLake-v1"
[[algorithm]]
algorithm = "q-learning"
"""


def _study_targets() -> list[Target]:
    def study() -> Any:
        return tuckerl.Study.from_text(_STUDY)

    none: Callable[[Any], None] = lambda result: None  # noqa: E731  # as below
    most, nowhere = {"most_runs": these(1, 100)}, [*these("nowhere", "."), lambda: Path("nowhere")]
    return [
        Target("Study.from_text", _calls(tuckerl.Study.from_text), {"text": these(_STUDY), **most}, 1, check=none),
        Target("Study.from_file", _calls(tuckerl.Study.from_file), {"path": PATHS, **most}, 1, check=none),
        Target("Study.from_folder", _calls(tuckerl.Study.from_folder), {"folder": nowhere, **most}, 1, check=none),
        Target("Study.status", lambda s, **k: s.status(**k), {"folder": nowhere}, 1, study, check=none),
        Target("Study.report", lambda s, **k: s.report(**k), {"folder": nowhere}, 1, study, check=none),
        Target(
            "Study.export",
            lambda s, **k: s.export(**k),
            {"folder": nowhere, "out": these(None, "a.csv"), "form": these(None, "csv", "parquet")},
            1,
            study,
            check=none,
        ),
    ]


def _gymnasium(env: Any) -> None:
    env.reset(seed=0)
    env.close()


@cache
def targets() -> tuple[Target, ...]:
    """Return everything that is called."""
    none: Callable[[Any], None] = lambda result: None  # noqa: E731  # shorter than all places that use it
    return (
        *(_constructor(kind, own) for kind, own in _LEARNERS),
        *(target for kind, own in _LEARNERS for target in _assignable(kind, own)),
        *(_method(name, *rest) for name, rest in _METHODS.items()),
        *_env_targets(),
        *command_lines(),
        Target(
            "EpsilonGreedy", _calls(tuckerl.EpsilonGreedy), {"epsilon": NUMBERS, "decay": these(1.0, 0.5)}, check=steers
        ),
        Target("Softmax", _calls(tuckerl.Softmax), {"temperature": NUMBERS}, 1, check=steers),
        Target("UCB", _calls(tuckerl.UCB), {"c": NUMBERS}, check=steers),
        Target(
            "OwnDistribution",
            _calls(tuckerl.OwnDistribution),
            {"name": these("x", ""), "epsilon": NUMBERS, "decay": these(1.0)},
            1,
            check=none,
        ),
        Target(
            "Linear",
            _calls(tuckerl.Linear),
            {"start": these(1.0, 0), "stop": these(0.0, 0.5), "episodes": COUNTS},
            3,
            check=runs,
        ),
        Target(
            "Exponential",
            _calls(tuckerl.Exponential),
            {"start": these(1.0, 0), "decay": these(0.5, 1), "minimum": these(0.1)},
            1,
            check=runs,
        ),
        Target(
            "Harmonic", _calls(tuckerl.Harmonic), {"start": these(1.0, 0), "half_after": these(3.0, 1)}, 2, check=runs
        ),
        Target(
            "Linear.values",
            lambda s, **k: s.values(**k),
            {"n_episodes": these(0, 3, 10)},
            1,
            lambda: tuckerl.Linear(1.0, 0.0, 3),
        ),
        Target(
            "Exponential.values",
            lambda s, **k: s.values(**k),
            {"n_episodes": these(0, 3, 10)},
            1,
            lambda: tuckerl.Exponential(1.0, 0.5),
        ),
        Target(
            "Harmonic.values",
            lambda s, **k: s.values(**k),
            {"n_episodes": these(0, 3, 10)},
            1,
            lambda: tuckerl.Harmonic(1.0, 2.0),
        ),
        *[
            Target(
                "TensorStep",
                _calls(tuckerl.TensorStep),
                {
                    "every": these(1, 2, 5),
                    "ranks": _RANKS,
                    "weights": these("paper", "relative", "constant", "permuted", "none", lambda d: [1.0, 0.5]),
                    "share": these(
                        *("max", "min", "best", "random", "mean", "visits", "consensus", "none"),
                        *(lambda c: 1, lambda c: [0.5, 0.5], lambda c: np.full(c.changes.shape, 1 / len(c.changes))),
                    ),
                    "floor": these(0.0, 0.1),
                    "tol": these(0.0, 1e-4),
                    "max_iterations": these(0, 5),
                    "shrink": these(0.0, 0.5),
                    "share_every": these(None, 1, 10),
                },
                2,
                check=steers,
                may_last=True,
            )
        ]
        * 2,
        *[Target("TabularMDP", _calls(tuckerl.TabularMDP), _TABLE, 3, check=plays, may_last=True)] * 2,
        Target("TabularMDP", _calls(tuckerl.TabularMDP), _DRAWS, 4, check=plays, may_last=True),
        *[Target("Simulator", _calls(tuckerl.Simulator), _SIMULATED, 5, check=simulates, may_last=True)] * 2,
        Target(
            "TabularMDP.with_time_limit",
            lambda p, **k: p.with_time_limit(**k),
            {"max_episode_steps": these(None, 3)},
            1,
            mdp,
            check=plays,
        ),
        Target("Maze", _calls(tuckerl.Maze), _MAZE, 3, check=plays, may_last=True),
        Target("Maze.state", lambda m, **k: m.state(**k), {"cell": _CELLS}, 1, tuckerl.sutton_maze),
        Target("Maze.cell", lambda m, **k: m.cell(**k), {"state": these(0, 53)}, 1, tuckerl.sutton_maze),
        Target(
            "Maze.heuristic",
            lambda m, **k: m.heuristic(**k),
            {"metric": these("squared", "l1", "euclidean")},
            0,
            tuckerl.sutton_maze,
        ),
        Target(
            "Maze.to_mdp",
            lambda m, **k: m.to_mdp(**k),
            {"step_reward": these(-1.0), "goal_reward": these(0.0, 1.0), "max_episode_steps": these(20, None)},
            0,
            tuckerl.sutton_maze,
            check=plays,
        ),
        Target(
            "random_maze",
            _calls(tuckerl.random_maze),
            {
                "rows": these(3, 6),
                "columns": these(5, 6),
                "deviation": these(0.0, 0.3),
                "seed": these(0, 1),
                "start": _CELLS,
                "goal": these((2, 3)),
            },
            6,
            check=plays,
            may_last=True,
        ),
        Target(
            "cart_pole",
            _calls(tuckerl.cart_pole),
            {
                "reward": these("shaped"),
                "start": these("fixed"),
                "force": these(10.0),
                "gravity": these(9.8),
                "cart_mass": these(1.0),
                "pole_mass": these(0.1),
                "half_length": these(0.5),
                "time_step": these(0.02),
                "track": these(4.0),
                "fall": these(45.0),
                "absorbing": FLAGS,
                "max_episode_steps": these(10, None),
            },
            check=plays,
        ),
        Target(
            "robot_rescue",
            _calls(tuckerl.robot_rescue),
            {
                "map": [*these(None), RescueMap],
                "step_cost": these(0.0),
                "grip_reward": these(1.0),
                "delivery_reward": these(10.0),
                "max_episode_steps": these(10),
            },
            5,
            check=plays,
        ),
        Target("RescueMap", _calls(RescueMap), {"text": these(RescueMap().text)}, 1, check=none),
        Target(
            "DynaMazeEnv",
            _calls(DynaMazeEnv),
            {
                "walls": [*these(None), lambda: np.zeros((5, 5), dtype=bool)],
                "rows": these(5),
                "columns": these(5),
                "deviation": these(0.0, 0.3),
                "maze_seed": these(0, 1),
                "start": these((0, 0)),
                "goal": these((4, 4)),
                "render_mode": these(None, "ansi", "rgb_array"),
            },
            7,
            check=_gymnasium,
            may_last=True,
        ),
        Target(
            "CartPoleEnv",
            _calls(CartPoleEnv),
            {"discrete": FLAGS, "render_mode": these(None, "rgb_array"), "force": these(10.0)},
            check=_gymnasium,
        ),
        Target(
            "RobotRescueEnv",
            _calls(RobotRescueEnv),
            {
                "map": [*these(None), RescueMap],
                "step_cost": these(0.0),
                "max_cycles": these(5, None),
                "render_mode": these(None, "ansi"),
            },
            check=_gymnasium,
        ),
        Target(
            "JointEnv", _calls(tuckerl.JointEnv), {"env": [rescue], "reward": these("mean", "sum")}, 1, check=_gymnasium
        ),
        Target(
            "SplitEnv",
            _calls(tuckerl.SplitEnv),
            {"env": [lambda: tuckerl.JointEnv(rescue())], "agents": [*these(None), lambda: ["a", "b"]]},
            1,
            check=_gymnasium,
        ),
        Target(
            "space_encoder",
            _calls(space_encoder),
            {"space": _SPACES, "bins": BINS, "what": these("observation")},
            2,
            check=encodes,
        ),
        Target(
            "encode",
            lambda e, **k: e.encode(**k),
            {"member": _MEMBERS},
            1,
            lambda: space_encoder(pole().observation_space, [[0.0]] * 4),
        ),
        Target(
            "decode",
            lambda e, **k: e.decode(**k),
            {"number": these(0, 15)},
            1,
            lambda: space_encoder(spaces.Box(-1, 1, (4,)), 2),
        ),
        Target(
            "encode",
            lambda e, **k: e.encode(**k),
            {"member": [lambda: (1, np.array([0, 1])), lambda: [2, [1, 1]]]},
            1,
            lambda: space_encoder(spaces.Tuple([spaces.Discrete(3), spaces.MultiBinary(2)])),
        ),
        Target(
            "solve",
            _calls(tuckerl.solve),
            {
                "env": ENVIRONMENTS,
                "gamma": these(0.9, 1.0, 0.0),
                "method": these(*METHODS),
                "tol": these(1e-8, 0.1),
            },
            1,
            check=_solved,
        ),
        Target("regret", _calls(tuckerl.regret), {"learner": [learner]}, 1),
        Target(
            "policy_value",
            _calls(tuckerl.policy_value),
            {
                "env": [mdp],
                "policy": [*these((0, 1, 1, 0)), lambda: np.full((4, 2), 0.5), lambda: [[0, 1]] * 4],
                "gamma": these(0.9, 0.0),
            },
            2,
        ),
        Target(
            "quantile_edges",
            _calls(tuckerl.quantile_edges),
            {"env": [pole, lambda: pole], "bins": these(2, (2, 3, 1, 2)), "steps": these(20), "seed": SEEDS},
            3,
            may_last=True,
        ),
        Target(
            "tucker",
            _calls(tuckerl.tucker),
            {"X": [_tensor], "ranks": _RANKS, "tol": these(0.0, 1e-4), "max_iterations": these(0, 5)},
            2,
            check=lambda d: sound([d.core, *d.factors, d.fit, d.to_tensor()]),
            may_last=True,
        ),
        Target("unfold", _calls(tuckerl.unfold), {"X": [_tensor], "mode": these(0, 3)}, 2, check=none),
        Target(
            "fold",
            _calls(tuckerl.fold),
            {
                "matrix": [lambda: tuckerl.unfold(_tensor(), 1)],
                "mode": these(1),
                "shape": [*these((4, 2, 3, 2)), lambda: [4, 2, 3, 2]],
            },
            3,
            check=none,
        ),
        Target(
            "mode_product",
            _calls(tuckerl.mode_product),
            {"X": [_tensor], "matrix": [lambda: np.ones((2, 3))], "mode": these(2)},
            3,
            check=none,
        ),
        Target(
            "action_weights",
            _calls(tuckerl.action_weights),
            {"action_factor": [lambda: np.ones((3, 2)), lambda: [[3.0], [4.0]]]},
            1,
        ),
        Target(
            "load",
            _calls(tuckerl.load),
            {
                "path": PATHS,
                "env": [*these(None), mdp],
                "tensor_step": STEPS,
                "alpha": NUMBERS,
                "gamma": these(0.5),
                "policy": POLICIES,
            },
            1,
            check=learns,
            may_last=True,
        ),
        Target(
            "QLearning.load",
            _calls(tuckerl.QLearning.load),
            {"path": PATHS, "env": [*these(None), mdp], "epsilon": NUMBERS},
            1,
            check=learns,
            may_last=True,
        ),
        Target(
            "StopOnReturn",
            _calls(tuckerl.StopOnReturn),
            {"threshold": these(1.0, -5), "episodes": COUNTS, "every": _EVERY},
            1,
            check=follows,
        ),
        Target(
            "Evaluate",
            _calls(tuckerl.Evaluate),
            {"episodes": COUNTS, "every": _EVERY, "seed": SEEDS, "best": these(None, "best.tuckerl")},
            1,
            check=follows,
            may_last=True,
        ),
        *[
            Target(
                kind.__name__, _calls(kind), {"path": these("log", "log{episode}"), "every": _EVERY}, 1, check=follows
            )
            for kind in (tuckerl.Checkpoint, tuckerl.CsvLog, tuckerl.JsonLinesLog)
        ],
        Target(
            "TensorBoard", _calls(tuckerl.TensorBoard), {"folder": these("board"), "every": _EVERY}, 1, check=follows
        ),
        Target("Callback", _calls(tuckerl.Callback), {"every": _EVERY}, 1, check=follows),
        *_study_targets(),
        Target("kernel", _calls(tuckerl.kernel), {"function": these(row)}, 1, check=none),
        Target(
            "inspect_learner",
            _calls(inspect_learner),
            {"learner": [learner], "title": these(None, "x"), "layout": these(None, (2, 2)), "action_names": NAMES},
            1,
            check=none,
        ),
        Target(
            "inspect_tensor",
            _calls(inspect_tensor),
            {
                "X": [_tensor],
                "ranks": _RANKS,
                "layout": these(None, (2, 2)),
                "title": these(None, "x"),
                "action_names": NAMES,
                "blocked": [*these(None), lambda: np.zeros((2, 2), dtype=bool)],
            },
            2,
            check=none,
        ),
        Target("inspection_figures", _calls(inspection_figures), {"inspection": these(ONLY_WRONG)}, 1, check=none),
        Target(
            "write_inspection",
            _calls(write_inspection),
            {"inspection": these(ONLY_WRONG), "folder": [lambda: Path("page")]},
            2,
            check=_written,
        ),
        Target(
            "check_problem",
            _calls(check_problem),
            {"problem": [mdp], "episodes": these(1), "seed": these(0)},
            2,
            check=none,
            may_last=True,
        ),
        Target(
            "pettingzoo id", _calls(lambda env: tuckerl.TeamQ(env, seed=0)), {"env": these(ONLY_WRONG)}, 1, check=none
        ),
    )
