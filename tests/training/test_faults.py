"""Environments that fail, lie, or never end: what is said, what is kept, and that learning goes on."""

import math
import signal
import time
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.adapters.parallel_worlds import Leaving
from tests.learners.stepped_worlds import SeededTableEnv, TableEnv
from tests.learners.worlds import random_mdp
from tests.training.test_resume import assert_same
from tuckerl import (
    Callback,
    DynaH,
    JointEnv,
    QLearning,
    Sarsa,
    SarsaLambda,
    Simulator,
    TabularMDP,
    TeamQ,
    TensorStep,
    sutton_maze,
)
from tuckerl.adapters import python_problem, resolve
from tuckerl.errors import EnvironmentFaultError, ObservationError, StepCapWarning, TableSizeError
from tuckerl.generalization.change_log import ENTRIES
from tuckerl.interrupts import interrupts_held_back, is_impatient
from tuckerl.training.trainer import Trainer

MDP = random_mdp(5, n_states=6, limit=12, ends=0.05)
STEP = TensorStep(every=4, ranks=(3, 2, 2, 2), floor=0.1)
LEARNERS: dict[str, tuple[Any, dict[str, Any]]] = {
    "q-learning": (QLearning, {}),
    "sarsa": (Sarsa, {}),
    "sarsa-lambda": (SarsaLambda, {"carry_trace": True}),
    "dyna-h": (DynaH, {"heuristic": np.arange(6.0)}),
    "team-q": (TeamQ, {}),
}


class Faulty(TableEnv):
    """Does something at chosen steps, counted over all episodes and from 1; resets are not counted."""

    def __init__(self, faults: Any = (), mdp: TabularMDP = MDP) -> None:
        super().__init__(mdp)
        self.faults, self.n_steps = set(faults), 0

    def fault(self, answer: Any) -> Any:
        raise ZeroDivisionError("no road")

    def step(self, action: int) -> Any:
        self.n_steps += 1
        answer = super().step(action)
        return self.fault(answer) if self.n_steps in self.faults else answer


def faulty(name: str, faults: Any, **parameters: Any) -> Any:
    made, own = LEARNERS[name]
    return made(Faulty(faults), **{"seed": 3, "epsilon": 0.4, "alpha": 0.3} | own | parameters)


def test_an_error_names_its_place_and_what_was_learned_is_kept() -> None:
    learner = QLearning(Faulty([17]), seed=3, epsilon=0.4)
    with pytest.raises(EnvironmentFaultError) as caught:
        learner.learn(9)
    whole = QLearning(Faulty(), seed=3, epsilon=0.4).learn(9)
    episodes = int(np.searchsorted(np.cumsum(whole.steps[:, 0]), 17))
    step = 17 - int(whole.steps[:episodes].sum())
    seed = np.random.SeedSequence(3, spawn_key=(0, 0, episodes)).generate_state(1)[0]
    assert f"Faulty failed (ZeroDivisionError: no road) in step {step} of episode {episodes} of this environment (seed "
    assert str(caught.value).startswith(
        f"Faulty failed (ZeroDivisionError: no road) in step {step} of episode {episodes} of this environment "
        f"(seed {seed}); what was learned before is kept"
    )
    assert isinstance(caught.value.__cause__, ZeroDivisionError)
    assert learner.episodes == episodes
    np.testing.assert_array_equal(learner.steps, whole.steps[:episodes])
    assert learner.trajectories[0].size == learner.steps[-1, 0] + 1, "of the latest episode that was whole"
    before = QLearning(Faulty(), seed=3, epsilon=0.4).learn(episodes)
    np.testing.assert_array_equal(learner.q, before.q, err_msg="what was broken off is undone")
    assert learner.learn(2).episodes == episodes + 2
    assert learner.trajectories[0].size == learner.steps[-1, 0] + 1


@pytest.mark.slow
@settings(deadline=None, max_examples=60)
@given(
    name=st.sampled_from(list(LEARNERS)),
    faults=st.sets(st.integers(1, 120), max_size=12),
    n_agents=st.integers(1, 2),
    with_step=st.booleans(),
    through_file=st.booleans(),
)
@pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")
def test_faults_anywhere_leave_nothing_broken(
    tmp_path_factory: pytest.TempPathFactory, name: str, faults: set[int], n_agents: int, with_step: bool, **how: bool
) -> None:
    path = tmp_path_factory.getbasetemp() / "faulty"
    made, own = LEARNERS[name]
    own = own | {"seed": 3, "epsilon": 0.4, "alpha": 0.3, "n_agents": n_agents}
    learner = made(lambda: Faulty(faults), tensor_step=STEP if with_step else None, **own)
    failures = 0
    while learner.episodes < 18:
        try:
            learner.learn(18 - learner.episodes)
        except EnvironmentFaultError:
            failures += 1
            if how["through_file"]:
                numbers = [world.env.n_steps for world in learner._state.worlds]
                learner.save(path)
                learner = made.load(path, env=lambda: Faulty(faults))
                for world, n_steps in zip(learner._state.worlds, numbers, strict=True):
                    world.env.n_steps = n_steps
        for log in learner.change_logs:
            closed = log.end.max(initial=0)
            assert log.cursor[ENTRIES] <= log.state.size
            assert log.cursor[ENTRIES] - closed <= 6, "an episode marks a row once"
    assert failures <= n_agents * len(faults)
    whole = made(lambda: Faulty(), tensor_step=STEP if with_step else None, **own).learn(18)
    np.testing.assert_array_equal(learner.q, whole.q)
    np.testing.assert_array_equal(learner.steps, whole.steps)
    assert np.isfinite(learner.q).all()
    assert learner.steps.shape == (18, n_agents)
    assert learner.steps.max() <= 12
    if with_step:
        assert learner.tensor_step_history.episode.tolist() == [4, 8, 12, 16]


@pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")
@pytest.mark.parametrize("name", LEARNERS)
def test_a_file_written_after_an_error_goes_on_as_the_learner_does(name: str, tmp_path: Path) -> None:
    learner = faulty(name, [17], tensor_step=STEP)
    with pytest.raises(EnvironmentFaultError):
        learner.learn(9)
    learner.save(tmp_path / "agent")
    again = type(learner).load(tmp_path / "agent", env=Faulty())
    assert_same(again, learner)
    assert_same(again.learn(10), learner.learn(10))


class AllOver(Faulty):
    """Every episode is everywhere, so that a log of few states is full."""

    def __init__(self, faults: Any = ()) -> None:
        states = np.arange(4)
        ring = TabularMDP(((states + 1) % 4)[:, None], np.ones((4, 1)), np.zeros((4, 1), np.bool_), max_episode_steps=8)
        super().__init__(faults, ring)


def test_a_log_that_is_nearly_full_has_room_for_an_episode_that_is_played_again(tmp_path: Path) -> None:
    learner = QLearning(AllOver([30, 38]), seed=0, tensor_step=TensorStep(every=4, ranks=(2, 1, 2, 1)))
    for _ in range(2):
        with pytest.raises(EnvironmentFaultError):
            learner.learn(4)
        learner.save(tmp_path / "agent")
        n_steps = learner._state.worlds[0].env.n_steps  # type: ignore[attr-defined]  # Python steps this world
        learner = QLearning.load(tmp_path / "agent", env=AllOver([30, 38]))
        learner._state.worlds[0].env.n_steps = n_steps  # type: ignore[attr-defined]  # Python steps this world
        assert learner.change_logs[0].cursor[ENTRIES] == 12 < learner.change_logs[0].state.size
    learner.save(tmp_path / "agent")
    learner.learn(1)
    assert learner.tensor_step_history.episode.tolist() == [4]


@pytest.mark.parametrize("reward", [math.nan, math.inf, -math.inf])
def test_rewards_that_are_not_finite_are_named(reward: float) -> None:
    class Pays(Faulty):
        def fault(self, answer: Any) -> Any:
            return (answer[0], reward, *answer[2:])

    learner = QLearning(Pays([3]), seed=0, epsilon=1.0)
    with pytest.raises(EnvironmentFaultError, match=rf"paid a reward that is not finite \({reward}\) in step 3 of epi"):
        learner.learn(2)
    assert np.isfinite(learner.q).all()
    assert learner.learn(2).episodes == 2


def test_an_error_after_a_reward_that_was_not_finite_is_not_taken_for_one() -> None:
    class Worse(Faulty):
        def fault(self, answer: Any) -> Any:
            if self.n_steps == 4:
                raise ZeroDivisionError("no road")
            return (answer[0], math.nan, *answer[2:])

    learner = QLearning(Worse([3, 4]), seed=0, epsilon=1.0)
    with pytest.raises(EnvironmentFaultError, match="paid a reward that is not finite"):
        learner.learn(2)
    with pytest.raises(EnvironmentFaultError, match="ZeroDivisionError: no road"):
        learner.learn(2)


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (lambda s, r, *rest: (s, None, *rest), "ProblemError: a reward must be one number; .* paid None"),
        (lambda s, r, *rest: (s, "much", *rest), "ProblemError: a reward must be one number; .* paid 'much'"),
        (lambda s, r, *rest: (6, r, *rest), "ObservationError: observation must be a whole number from 0 to 5"),
        (lambda s, r, *rest: (-1, r, *rest), "ObservationError: "),
        (lambda s, r, *rest: (1.5, r, *rest), "ObservationError: "),
        (lambda s, r, *rest: (np.array([1, 2]), r, *rest), "ObservationError: "),
        (lambda s, r, *rest: (None, r, *rest), "ObservationError: "),
        (lambda s, r, *rest: (s, r), "ProblemError: step must return"),
        (lambda s, r, a, b, info: (s, r, a, b, {"action_mask": [1, 1, 0]}), "must give one in its reset, too"),
    ],
)
def test_impossible_answers_are_named(answer: Any, message: str) -> None:
    class Answers(Faulty):
        def fault(self, given: Any) -> Any:
            return answer(*given)

    learner = QLearning(Answers([2]), seed=0, epsilon=1.0)
    with pytest.raises(
        EnvironmentFaultError, match=rf"Answers failed \(.*{message}.* in step 2 of episode 0 "
    ) as caught:
        learner.learn(1)
    assert isinstance(caught.value, RuntimeError)
    assert learner.learn(3).episodes == 3


def test_what_is_observed_outside_of_its_space_is_found() -> None:
    class Grows(Faulty):
        def reset(self, **how: Any) -> Any:
            state, info = super().reset(**how)
            return (state if self.n_steps == 0 else 19), info

    learner = QLearning(Grows(), seed=0, epsilon=1.0)
    with pytest.raises(EnvironmentFaultError, match=r"whole number from 0 to 5.*got 19 .* in reset of episode 1 of"):
        learner.learn(3)
    assert learner.episodes == 1


def test_a_first_observation_outside_of_its_space_is_refused_at_once() -> None:
    class Outside(Faulty):
        def reset(self, **how: Any) -> Any:
            return 17, {}

    class Unready(Faulty):
        def reset(self, **how: Any) -> Any:
            raise OSError("no display")

    with pytest.raises(ObservationError, match="observation must be a whole number from 0 to 5"):
        QLearning(Outside())
    with pytest.raises(ValueError, match="Unready does not begin: reset raised OSError: no display"):
        QLearning(Unready())


def test_a_reset_that_fails_later_is_named_and_tried_again() -> None:
    class Unready(Faulty):
        n_resets = 0

        def reset(self, **how: Any) -> Any:
            self.n_resets += 1
            if self.n_resets == 4:  # the first one tries it out
                raise OSError("no display")
            return super().reset(**how)

    learner = QLearning(Unready(), seed=0)
    with pytest.raises(EnvironmentFaultError, match=r"failed \(OSError: no display\) in reset of episode 2 of this"):
        learner.learn(4)
    assert learner.episodes == 2
    assert learner.trajectories
    assert learner.learn(2).episodes == 4


def test_errors_that_are_no_faults_go_through() -> None:
    class Stops(Faulty):
        def fault(self, answer: Any) -> Any:
            raise SystemExit(3)

    class TimeIsUpError(BaseException):
        pass

    class Late(Faulty):
        def fault(self, answer: Any) -> Any:
            raise TimeIsUpError

    with pytest.raises(SystemExit):
        QLearning(Stops([2]), seed=0).learn(1)
    with pytest.raises(TimeIsUpError):
        QLearning(Late([2]), seed=0).learn(1)


class Slow(Faulty):
    """Takes its time for chosen steps."""

    def fault(self, answer: Any) -> Any:
        if self.n_steps == 20:
            raise ZeroDivisionError("no road")
        time.sleep(0.05)
        return answer


def test_callbacks_see_a_learner_in_sync_only(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[tuple[int, bool]] = []

    class Looks(Callback):
        def on_window(self, learner: Any) -> None:
            seen.append((learner.episodes, learner.history.in_sync))

    # The second agent falls behind by an error, and is slow to catch up.
    monkeypatch.setattr("tuckerl.training.trainer.SLICE", 0.02)
    environments = iter([Faulty(), Slow([20, 24, 36])])
    learner = QLearning(lambda: next(environments), seed=3, n_agents=2)
    with pytest.raises(EnvironmentFaultError):
        learner.learn(8)
    assert not learner.history.in_sync
    learner.learn(8, callbacks=[Looks(every=1)])
    assert seen
    assert all(in_sync for _, in_sync in seen)


# A learner that is saved while one agent is ahead of the others


def test_agents_that_catch_up_after_loading_are_followed_as_if_they_had_not_been_saved(tmp_path: Path) -> None:
    def uneven() -> QLearning:
        learner = QLearning(TableEnv(MDP), n_agents=2, seed=0, tensor_step=TensorStep(every=5, ranks=(2, 2, 2, 1)))
        learner.learn(2)  # which loads the kernels, so that nobody stops because it is late
        Trainer(learner, learner._state, (), learner._owner)._play_world(0, [0], 5, 10**9)
        return learner

    never_saved, saved = uneven(), uneven()
    assert (saved.is_saveable, saved.in_sync) == (True, False)
    saved.save(tmp_path / "agent")
    again = QLearning.load(tmp_path / "agent", env=TableEnv(MDP))
    windows: dict[str, list[int]] = {"never saved": [], "saved": []}
    never_saved.learn(3, callbacks=[lambda learner: windows["never saved"].append(learner.episodes)])
    again.learn(3, callbacks=[lambda learner: windows["saved"].append(learner.episodes)])
    assert windows == {"never saved": [5], "saved": [5]}
    assert_same(again, never_saved)
    assert all(path.size > 1 for path in again.trajectories)


# Environments that never end


@pytest.fixture
def small_cap(monkeypatch: pytest.MonkeyPatch) -> int:
    for module in (python_problem, resolve):
        monkeypatch.setattr(module, "STEP_CAP", 25)
    return 25


ENDLESS = random_mdp(1, ends=0.0, limit=10**6)


def _resets(parameters: Any, state: Any, rng: Any) -> None:
    state[0] = 0.0


def _goes_round(parameters: Any, state: Any, action: int, rng: Any) -> tuple[float, bool]:
    state[0] = 1.0 - state[0]
    return -1.0, False


ENDLESS_PROBLEMS: dict[str, Any] = {
    "table": lambda: TabularMDP([[0, 1], [0, 1]], np.zeros((2, 2)), np.zeros((2, 2), np.bool_)),
    "maze": lambda: sutton_maze().to_mdp(max_episode_steps=None),
    "simulator": lambda: Simulator(_resets, _goes_round, n_states=2, n_actions=2),
    "environment": lambda: TableEnv(ENDLESS),
    "agents": lambda: Leaving((10**6, 2)),
}


@pytest.mark.parametrize("kind", ENDLESS_PROBLEMS)
def test_problems_of_every_kind_are_cut_off_where_nothing_limits_them(kind: str, small_cap: int) -> None:
    learner = QLearning(ENDLESS_PROBLEMS[kind](), epsilon=0.0, ties="first", seed=0)
    assert learner.problem.is_capped
    with pytest.warns(StepCapWarning, match="cut off after 25 steps"):
        learner.learn(steps=60)
    assert learner.steps[:, 0].tolist() == [25] * 3, "60 steps and what is left of the last episode"
    with pytest.warns(StepCapWarning, match="cut off after 25 steps"):
        assert learner.evaluate(2).steps.max() == 25


@pytest.mark.parametrize("made", [lambda: QLearning(TableEnv(ENDLESS), seed=0), lambda: TeamQ(TableEnv(ENDLESS))])
def test_an_environment_that_never_ends_is_cut_off_with_one_warning(made: Any, small_cap: int) -> None:
    learner = made()
    message = "cut off after 25 steps, as the environment has no time limit: set one, for example by max_episode_steps"
    with pytest.warns(StepCapWarning, match=message) as caught:
        learner.learn(3).learn(2)
    assert [warning.filename for warning in caught] == [__file__]
    assert learner.steps.tolist() == [[25]] * 5
    with pytest.warns(StepCapWarning, match="cut off after 25 steps") as caught:
        learner.evaluate(2)
    assert [warning.filename for warning in caught] == [__file__]


def test_agents_of_which_the_first_leaves_are_cut_off_with_a_warning(small_cap: int) -> None:
    learner = QLearning(Leaving((2, 99)), seed=0)
    with pytest.warns(StepCapWarning, match="cut off after 25 steps"):
        learner.learn(2)
    assert learner.steps.tolist() == [[2, 25]] * 2


def test_the_warning_comes_for_extracted_tables_too(small_cap: int, tmp_path: Path) -> None:
    learner = QLearning("CliffWalking-v1", seed=0, epsilon=1.0)
    assert learner.problem.is_capped
    learner.save(tmp_path / "agent")
    again = QLearning.load(tmp_path / "agent")
    assert again.problem.is_capped
    with pytest.warns(StepCapWarning, match="cut off after 25 steps"):
        again.learn(3)


def test_a_limit_of_the_users_own_is_no_surprise() -> None:
    QLearning(gymnasium.wrappers.TimeLimit(TableEnv(ENDLESS), 5), seed=0).learn(3)


# Ctrl-C


class Pressed(Faulty):
    """Ctrl-C is pressed at chosen steps."""

    def fault(self, answer: Any) -> Any:
        signal.raise_signal(signal.SIGINT)
        return answer


@pytest.mark.parametrize("n_agents", [1, pytest.param(2, marks=pytest.mark.compiled)])  # so that both get to play
def test_the_first_ctrl_c_waits_for_the_end_of_what_is_played(n_agents: int) -> None:
    presses = iter([[30]])  # the first agent's environment, which is made first, has it
    learner = QLearning(lambda: Pressed(next(presses, ())), seed=3, n_agents=n_agents)
    with pytest.raises(KeyboardInterrupt):
        learner.learn(1500)
    assert learner.episodes > 0
    assert all(path.size for path in learner.trajectories), "no episode was broken off"
    learner.learn(1500 - learner.episodes)
    np.testing.assert_array_equal(learner.q, QLearning(lambda: Faulty(), seed=3, n_agents=n_agents).learn(1500).q)


@pytest.mark.parametrize("name", LEARNERS)
def test_the_second_ctrl_c_breaks_off_at_once(name: str, tmp_path: Path) -> None:
    made, own = LEARNERS[name]
    learner = made(Pressed([30, 31]), seed=3, **own)
    with pytest.raises(KeyboardInterrupt):
        learner.learn(500)
    assert learner._state.worlds[0].env.n_steps == 31
    assert not is_impatient()
    learner.save(tmp_path / "agent")
    again = made.load(tmp_path / "agent", env=Pressed())
    assert_same(again.learn(5), learner.learn(5))


def test_ctrl_c_is_not_forgotten_where_an_error_comes_too() -> None:
    def fails() -> None:
        with interrupts_held_back():
            signal.raise_signal(signal.SIGINT)
            raise ZeroDivisionError

    with pytest.raises(KeyboardInterrupt) as caught:
        fails()
    assert isinstance(caught.value.__context__, ZeroDivisionError)


def test_ctrl_c_ends_an_evaluation_at_once() -> None:
    learner = QLearning(Pressed([40]), seed=3).learn(1)
    learner._state.worlds[0].env.n_steps = 0  # type: ignore[attr-defined]  # the evaluation plays a copy
    with pytest.raises(KeyboardInterrupt):
        learner.evaluate(10**6)
    assert not is_impatient()
    assert learner.learn(1).episodes == 2


# Sizes, spaces


def test_a_table_too_large_for_memory_is_refused_before_it_is_made() -> None:
    class Wide(Faulty):
        def __init__(self) -> None:
            super().__init__()
            self.observation_space = spaces.Box(0.0, 1.0, (6,))

        def reset(self, **how: Any) -> Any:
            return np.zeros(6, dtype=np.float32), {}

    with pytest.raises(
        TableSizeError, match=r"QLearning would take about 10\^19 bytes of .*: use fewer or coarser bins"
    ):
        QLearning(Wide(), bins=1000)
    with pytest.raises(MemoryError, match="GiB"):
        TeamQ(JointEnv(Crowd()))


class Crowd(Leaving):
    """Fifteen agents, of which each sees ten things."""

    def __init__(self) -> None:
        super().__init__((9,) * 15)


def test_spaces_that_cannot_be_numbered() -> None:
    class Steered(Faulty):
        def __init__(self) -> None:
            super().__init__()
            self.action_space = spaces.Box(-1.0, 1.0)

    class Unbounded(Faulty):
        def __init__(self) -> None:
            super().__init__()
            self.observation_space = spaces.Box(-np.inf, np.inf, (2,))

    with pytest.raises(ValueError, match="action must be one of finitely many"):
        QLearning(Steered())
    with pytest.raises(ValueError, match="edges"):
        QLearning(Unbounded(), bins=4)


@pytest.mark.parametrize("given", [{}, {"episodes": 3, "steps": 3}])
def test_either_episodes_or_steps(given: dict[str, Any]) -> None:
    learner = QLearning(SeededTableEnv(MDP), seed=0)
    with pytest.raises(ValueError, match=r"learn\(\) takes either episodes or steps"):
        learner.learn(**given)
    assert learner.learn(steps=30).first_agent_steps >= 30
