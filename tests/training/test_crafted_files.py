"""Files whose checksum is right and whose content is not: each kind of lie is told apart and named."""

import contextlib
import io
import json
import random
import re
import resource
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.adapters.parallel_worlds import Masked
from tests.learners.stepped_worlds import SeededTableEnv
from tests.learners.test_masks import masked_mdp
from tests.learners.worlds import corridor, random_mdp
from tests.training import crafted_files as crafted
from tests.training.crafted_files import Parts, take_apart
from tuckerl import DynaH, QLearning, SarsaLambda, TeamQ, TensorStep, load
from tuckerl.environments.robot_rescue_env import RobotRescueEnv
from tuckerl.errors import SavedFileError

STEP = TensorStep(every=4, ranks=(2, 2, 2, 2))
MDP = random_mdp(3, n_states=6, n_outcomes=2, random_start=True, limit=20)

pytestmark = pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")


def parts_of(learner: Any, folder: Path) -> Parts:
    learner.save(folder / "agent.tuckerl")
    return take_apart((folder / "agent.tuckerl").read_bytes())


@pytest.fixture(scope="module")
def parts(tmp_path_factory: pytest.TempPathFactory) -> Parts:
    learner = DynaH(corridor(), n_agents=2, planning_steps=3, seed=1, tensor_step=STEP).learn(6)
    return parts_of(learner, tmp_path_factory.mktemp("dyna"))


@pytest.fixture(scope="module")
def traced(tmp_path_factory: pytest.TempPathFactory) -> Parts:
    learner = SarsaLambda(MDP, carry_trace=True, seed=2).learn(6)
    return parts_of(learner, tmp_path_factory.mktemp("traced"))


def refusal(parts: Parts, path: Path, env: Any = None) -> str:
    crafted.rewrite(path, parts)
    with pytest.raises(SavedFileError, match="agent") as caught:
        load(path, env=env)
    assert len(str(caught.value)) <= 600
    return str(caught.value)


def changed(parts: Parts, name: str, change: Callable[[np.ndarray], Any]) -> Parts:
    array = parts.arrays[name].copy()
    other = change(array)
    return parts._replace(arrays=parts.arrays | {name: array if other is None else np.asarray(other)})


def put(value: Any, place: Any = 0) -> Callable[[np.ndarray], None]:
    def change(array: np.ndarray) -> None:
        array[place] = value

    return change


@pytest.mark.parametrize(
    ("name", "change", "message"),
    [
        (
            "state/q",
            lambda a: np.zeros((1, 1, 1)),
            r"state/q must be float64 of the shape \(2, 5, 2\); it is float64 of",
        ),
        ("state/q", put(np.nan), "state/q must be finite everywhere"),
        ("state/q", lambda a: a.astype(np.float32), "must be float64 of"),
        ("state/streams", lambda a: a[:, :1], r"state/streams must be uint64 of the shape \(2, 4\)"),
        ("state/streams", put(0, 1), "streams of random numbers must not be zero"),
        ("state/weights", put(np.inf), "the weights of actions must be those of the latest window"),
        ("state/weights", put(0.5), "the weights of actions must be those of the latest window"),
        ("state/steps", put(-1), "state/steps must be at least 0"),
        ("state/returns", put(np.nan), "the returns of episodes must be numbers"),
        ("state/finished", put(7), "it has 6 episodes"),
        ("state/finished", lambda a: a - 6, "it has 6 episodes"),
        ("state/trajectory", put(5), "state/trajectory must be at least 0 and at most 4"),
        ("agents/1/log/state", put(5), "agents/1/log/state must be at least 0 and at most 4"),
        ("agents/1/log/state", put(0, slice(None)), "each episode of a change log must hold each number once"),
        ("agents/0/log/end", put(11), "a change log must have an end for each episode"),
        ("agents/0/log/end", lambda a: a[:1], "agents/0/log/row must be|an end for each episode"),
        ("step/states", put(-1), "step/states must be at least 0"),
        ("step/states", put(0, slice(None)), "the states of a window must hold each number once"),
        ("step/base", put(np.inf), "step/base must be finite"),
        ("step/episode", put(8), "its windows must end every 4 episodes"),
        ("step/chosen", put(2), "step/chosen must be at least -1 and at most 1"),
        ("step/loadings/states", put(99), "step/loadings/states must be"),
        ("step/loadings/factor1", lambda a: a[:, :0], "step/loadings/factor1 must be"),
        ("problem/next_state", put(2**31 - 1), "problem/next_state must be at least 0 and at most 4"),
        ("problem/reward", put(np.nan), "problem/reward must be finite"),
        ("problem/start_state", put(5), "problem/start_state must be"),
        ("problem/start_cumulative", put(0.5), "start_cumulative must rise to 1"),
        ("problem/heuristic", put(np.inf), "heuristic must be 5 finite numbers"),
        ("problem/offsets", lambda a: np.arange(11), "cumulative must be float64 of"),
        ("problem/action_mask", lambda a: np.zeros((5, 2), dtype=bool), "action_mask must allow an action in every"),
        (
            "parameters/heuristic",
            lambda a: np.zeros(9),
            "the parameter 'heuristic' is there twice, or has the impossible",
        ),
        ("agents/0/arrays/model.farthest", put(2), "model.farthest must be at least 0 and at most 1"),
        ("agents/0/arrays/model.farthest", lambda a: 1 - a, "the farthest actions of a model must be those of its out"),
        (
            "agents/0/arrays/model.n_farthest",
            put(0),
            "the observed states of a model must be those of which it has act",
        ),
        ("agents/0/arrays/model.observed", put(4), "the observed states of a model"),
        ("agents/0/arrays/model.n_observed", put(9), "model.n_observed must be at least 0 and at most 5"),
        ("agents/0/arrays/model.distance", put(np.nan, slice(None)), "the farthest actions of a model"),
        ("agents/0/arrays/model.outcome", lambda a: a["next_state"].__setitem__(slice(None), 5), "outcomes of a model"),
        (
            "agents/0/arrays/model.outcome",
            lambda a: np.put(a["discount"], np.flatnonzero(a["discount"])[:1], 2.0),  # one of many
            "outcomes of a model must lead to states",
        ),
    ],
)
def test_arrays_that_are_not_what_they_must_be_are_refused(
    name: str, change: Callable[[np.ndarray], Any], message: str, parts: Parts, tmp_path: Path
) -> None:
    assert re.search(message, refusal(changed(parts, name, change), tmp_path / "agent.tuckerl"))


@pytest.mark.parametrize(
    ("name", "change", "message"),
    [
        ("state", put(6), "records/traces/state must be at least 0 and at most 5"),
        ("state", put(3, slice(None)), "the states that have traces must hold each number once"),
        ("constant", put(np.nan), "records/traces/constant must be at least 0.0 and finite"),
        ("constant", lambda a: a[:1], "records/traces/constant must be float64 of"),
    ],
)
def test_traces_are_checked(name: str, change: Any, message: str, traced: Parts, tmp_path: Path) -> None:
    found = refusal(changed(traced, f"agents/0/records/traces/{name}", change), tmp_path / "agent.tuckerl")
    assert message in found


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda a: a.__setitem__(slice(1, None), a[1]), "offsets must rise from 0, as each pair has an outcome"),
        (lambda a: a + 1, "offsets must rise from 0"),
    ],
)
def test_outcomes_are_checked(change: Any, message: str, traced: Parts, tmp_path: Path) -> None:
    assert message in refusal(changed(traced, "problem/offsets", change), tmp_path / "agent.tuckerl")
    less = changed(traced, "problem/cumulative", lambda a: a * 0.5)
    assert "cumulative must rise to 1 over the outcomes of each pair" in refusal(less, tmp_path / "agent.tuckerl")


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        (("seed",), None, "'seed' of the header must"),
        (("seed", "entropy"), -1, "non-negative|unsigned|out of bounds"),
        (("seed", "spawn_key"), ["x"], "an entry of 'spawn_key'"),
        (("prediction_rng", "state", "inc"), 2, "its increment must be odd"),
        (("prediction_rng", "uinteger"), 2**32, "no state of a random generator PCG64"),
        (("prediction_rng",), {}, "no state of a random generator PCG64"),
        (("diverged_at",), 7, "it diverged in episode 7"),
        (("diverged_at",), True, "'diverged_at' of the header must"),
        (("worlds",), [{}], "it must hold 2 worlds; it holds 1"),
        (("worlds",), [{}, {"resets": 1}], "this problem has none"),
        (("parameters", "alpha"), 2, "alpha must be a number in"),
        (("parameters", "alpha"), {"schedule": []}, "schedule must be one of"),
        (("parameters", "n_agents"), 10**9, "it must hold 1000000000 agents; it holds 2"),
        (("parameters", "seed"), 3, "DynaH has no parameter 'seed'"),
        (("parameters", "beta"), 3, "DynaH has no parameter 'beta'"),
        (("tensor_step", "ranks"), [2, 2], "ranks must be four whole numbers"),
        (("tensor_step", "every"), 5, "its windows of 5 episodes|must end every 5"),
        (("tensor_step", "sooner"), 5, "unexpected keyword argument 'sooner'"),
        (("tensor_step",), None, "the weights of actions must be|holds arrays that no such learner has, step/"),
        (("problem", "kind"), "maze", "a problem of an unknown kind"),
        (("problem", "held", "n_states"), 10**30, "must be"),
        (("problem", "held", "n_actions"), 0, "n_actions must be a whole number of at least 1"),
        (("problem", "held", "max_episode_steps"), -1, "max_episode_steps must be"),
        (("problem", "held", "action_sizes"), [3], "action_sizes must multiply to the number of actions"),
        (("problem", "held", "layout"), [2, 2], "layout must be"),
        (("problem", "held", "action_names"), ["a"], "action_names must be 2 names"),
        (("learner",), "os:Lost", "holds a Lost, which is none of QLearning.*import the module os, which"),
        (("learner",), 3, "'learner' of the header must be str; got 3"),
        (("extra",), 3, "the header has an unknown 'extra'"),
    ],
)
def test_headers_are_checked(path: tuple[str, ...], value: Any, message: str, parts: Parts, tmp_path: Path) -> None:
    header = json.loads(json.dumps(parts.header))
    place = header
    for name in path[:-1]:
        place = place[name]
    place[path[-1]] = value
    assert re.search(message, refusal(parts._replace(header=header), tmp_path / "agent.tuckerl"))


@pytest.mark.parametrize("name", ["state/q", "step/base", "agents/1/log/end", "problem/reward", "parameters/heuristic"])
def test_missing_and_unknown_arrays_are_refused(name: str, parts: Parts, tmp_path: Path) -> None:
    kept = {other: array for other, array in parts.arrays.items() if other != name}
    if not name.startswith("parameters"):  # a parameter has a default
        assert f"lacks the array {name}" in refusal(parts._replace(arrays=kept), tmp_path / "agent.tuckerl")
    more = parts._replace(arrays=parts.arrays | {f"{name}2": parts.arrays[name]})
    assert name.removeprefix("parameters/") in refusal(more, tmp_path / "agent.tuckerl")


@pytest.mark.parametrize(
    "text",
    [
        '{"x": 1, "x": 2}',
        "[" * 100_000,
        '{"x": NaN}',
        '{"x": 1e999}',
        "[]",
        '{"x": ' + "9" * 5000 + "}",
        '{"x": "\\ud800"}',
    ],
)
def test_texts_that_are_no_header_are_refused(text: str, parts: Parts, tmp_path: Path) -> None:
    path = tmp_path / "agent.tuckerl"
    for version in (2, 3):
        path.write_bytes(crafted.put_together(parts._replace(version=version), text))
        with pytest.raises(SavedFileError, match="holds no sound learner"):
            load(path)


# The archive


def members_of(parts: Parts) -> dict[str, bytes]:
    with zipfile.ZipFile(io.BytesIO(crafted.put_together(parts).split(b"\n", 2)[2])) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def refused_archive(body: bytes, path: Path) -> str:
    path.write_bytes(crafted.sign(3, body))
    with pytest.raises(SavedFileError, match="holds no sound learner") as caught:
        load(path)
    return str(caught.value)


def test_archives_are_of_one_form(parts: Parts, tmp_path: Path) -> None:
    members, path = members_of(parts), tmp_path / "agent.tuckerl"
    path.write_bytes(crafted.sign(3, crafted.archive_of(members)))
    assert load(path).episodes == 6
    assert "packed in another way" in refused_archive(crafted.archive_of(members, zipfile.ZIP_BZIP2), path)
    assert "'notes.txt' is no array" in refused_archive(crafted.archive_of(members | {"notes.txt": b"x"}), path)
    assert "lacks its manifest" in refused_archive(crafted.archive_of({"state/q.npy": members["state/q.npy"]}), path)
    less = {name: member for name, member in members.items() if name != "state/q.npy"}
    assert "its manifest and its arrays differ: 'state/q'" in refused_archive(crafted.archive_of(less), path)
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, member in [*members.items(), ("state/q.npy", members["state/q.npy"])]:
            with (
                pytest.warns(UserWarning, match="Duplicate name")
                if name in archive.namelist()
                else contextlib.nullcontext()
            ):
                archive.writestr(name, member)
    assert "is there twice" in refused_archive(buffer.getvalue(), path)


def test_a_manifest_says_what_its_arrays_are(parts: Parts, tmp_path: Path) -> None:
    path, forms = tmp_path / "agent.tuckerl", crafted.manifest_of(parts.arrays)
    assert forms["step/chosen"]["bounds"] == [0, 0]
    for change in ({"dtype": "<i4"}, {"shape": [2]}, {"bounds": [0, 1]}, {"bounds": None}, {"more": 1}):
        form = forms["step/chosen"] | change
        path.write_bytes(crafted.put_together(parts, forms=forms | {"step/chosen": form}))
        with pytest.raises(SavedFileError, match="manifest"):
            load(path)


def test_booleans_are_false_or_true(parts: Parts, tmp_path: Path) -> None:
    odd = changed(parts, "problem/terminated", lambda a: a.view(np.uint8).__setitem__(0, 2))
    assert "must hold booleans" in refusal(odd, tmp_path / "agent.tuckerl")


@pytest.mark.slow
def test_nothing_is_unpacked_before_its_size_is_known_to_be_right(parts: Parts, tmp_path: Path) -> None:
    path = tmp_path / "agent.tuckerl"
    size = 2**28
    for name in (
        "state/q",
        "agents/0/log/state",
        "parameters/heuristic",
        "problem/cumulative",
        "state/trajectory",
        "x",
    ):
        members = members_of(parts) | {f"{name}.npy": crafted.huge_zeros((size // 8,), "<f8")}
        manifest = json.loads(members["manifest.json"])
        manifest["arrays"][name] = {"dtype": "<f8", "shape": [size // 8]}
        members["manifest.json"] = json.dumps(manifest).encode()
        buffer = io.BytesIO()
        with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
            for member, content in members.items():
                with archive.open(member, "w", force_zip64=True) as file:
                    file.write(content)
                    for _ in range(size // 2**24 if member == f"{name}.npy" else 0):
                        file.write(bytes(2**24))
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        path.write_bytes(crafted.sign(3, buffer.getvalue()))
        assert path.stat().st_size < 2**20
        with pytest.raises(
            SavedFileError, match=r"it is float64 of the shape|has the impossible shape|no such learner"
        ):
            load(path)
        grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * 1024
        assert grown < size // 4, f"{name} was unpacked"


# Environments that Python steps


def test_masks_that_were_seen_are_checked(tmp_path: Path) -> None:
    parts = parts_of(QLearning(Masked(), seed=1).learn(4), tmp_path)
    path = tmp_path / "agent.tuckerl"
    none = changed(parts, "agents/0/action_mask", put(False, slice(None)))
    assert "an action mask must allow an action in every state" in refusal(none, path, Masked())


def test_agents_of_one_world_have_finished_equally_many_episodes(tmp_path: Path) -> None:
    parts = parts_of(QLearning(Masked(), seed=1).learn(4), tmp_path)
    behind = changed(parts, "state/finished", put(2, -1))  # it could not catch up, and `learn` would wait for that
    said = refusal(behind, tmp_path / "agent.tuckerl", Masked())
    assert "agents that share a world must have finished equally many episodes" in said


def test_a_wrong_parameter_is_the_files_fault_also_where_an_environment_is_given(tmp_path: Path) -> None:
    parts = parts_of(QLearning(Masked(), seed=1).learn(2), tmp_path)
    parameters = parts.header["parameters"] | {"compiled": 3}
    said = refusal(parts._replace(header=parts.header | {"parameters": parameters}), tmp_path / "agent", Masked())
    assert "compiled must be 'auto', True or False; got 3" in said


def test_places_in_a_block_of_random_numbers_are_checked(tmp_path: Path) -> None:
    class Twisted(SeededTableEnv):
        def reset(self, **options: Any) -> Any:
            if options.get("seed") is not None:
                self._np_random = np.random.Generator(np.random.MT19937(options.pop("seed")))
            return super().reset(**options)

    parts = parts_of(QLearning(Twisted(MDP), seed=1).learn(4), tmp_path)
    path, header = tmp_path / "agent.tuckerl", parts.header
    load(path, env=Twisted(MDP)).learn(1)
    held = header["worlds"][0]["generator"]
    for place in (-1, 625, 2**31 - 1):
        odd = held | {"state": held["state"] | {"pos": place}}
        world = header["worlds"][0] | {"generator": odd}
        found = refusal(parts._replace(header=header | {"worlds": [world]}), path, Twisted(MDP))
        assert "no state of a random generator MT19937" in found


OWN = np.random.RandomState(1), np.random.Generator(np.random.MT19937(1)), random.Random(1)  # noqa: S311  # no secrets


@pytest.mark.parametrize("own", OWN)
def test_states_of_an_environments_own_generators_are_checked(own: Any, tmp_path: Path) -> None:
    def made() -> Any:
        env = SeededTableEnv(MDP)
        env.own = own  # type: ignore[attr-defined]  # as users' environments have one
        return env

    parts = parts_of(QLearning(made(), seed=1).learn(4), tmp_path)
    world = parts.header["worlds"][0]
    (place,) = [place for place in world["own generators"] if place.endswith(".own")]
    state = world["own generators"][place]["state"]
    if isinstance(own, random.Random):
        odd: list[Any] = [[3, [*state[1][:-1], last], None] for last in (-1, 625, 2**40)] + [[3, state[1][:9], None]]
    else:
        odd = [state | {"pos": pos} for pos in (-1, 625, 2**31 - 1)] + [{"key": state["key"][:9], "pos": 0}, 7]
    for one in odd:
        held = world["own generators"] | {place: world["own generators"][place] | {"state": one}}
        crafted = parts._replace(header=parts.header | {"worlds": [world | {"own generators": held}]})
        assert "no state of a random generator" in refusal(crafted, tmp_path / "agent.tuckerl", made())
    crafted = parts._replace(header=parts.header | {"worlds": [world | {"own generators": {place: 7}}]})
    assert "own generators" in refusal(crafted, tmp_path / "agent.tuckerl", made())


def test_a_team_is_paid_by_what_its_environment_was_paid_by(tmp_path: Path) -> None:
    path, env = tmp_path / "agent.tuckerl", RobotRescueEnv(".H.\nATB", max_cycles=4)
    parts = parts_of(TeamQ(env, team_reward="robot_1", seed=1).learn(2), tmp_path)
    load(path, env=RobotRescueEnv(".H.\nATB", max_cycles=4)).learn(1)
    for reward in ("sum", "robot_0", "robot_9", "", 3, None):
        header = parts.header | {"parameters": parts.header["parameters"] | {"team_reward": reward}}
        found = refusal(parts._replace(header=header), path, RobotRescueEnv(".H.\nATB", max_cycles=4))
        assert f"has the team_reward {reward!r}, by which its environment has not paid" in found


def test_a_file_imports_no_module(tmp_path: Path) -> None:
    parts = parts_of(QLearning("FrozenLake-v1", compiled=False, seed=1).learn(4), tmp_path)
    assert "antigravity" not in sys.modules
    held = parts.header["problem"]["held"] | {"id": "antigravity:FrozenLake-v1"}
    problem = parts.header["problem"] | {"held": held}
    found = refusal(parts._replace(header=parts.header | {"problem": problem}), tmp_path / "agent.tuckerl")
    assert "of a module that has not been imported" in found
    assert "antigravity" not in sys.modules
    held = held | {"id": "Lost-v0"}
    problem = parts.header["problem"] | {"held": held}
    found = refusal(parts._replace(header=parts.header | {"problem": problem}), tmp_path / "agent.tuckerl")
    assert "Lost-v0" in found


def test_a_problem_with_masks_comes_back(tmp_path: Path) -> None:
    whole = QLearning(masked_mdp(6, n_states=6, n_outcomes=2, limit=20), seed=1).learn(4)
    whole.save(tmp_path / "agent.tuckerl")
    np.testing.assert_array_equal(load(tmp_path / "agent.tuckerl").learn(4).q, whole.learn(4).q)
