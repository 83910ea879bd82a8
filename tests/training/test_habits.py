"""What users of neighbouring libraries type works, or is answered with the word to use."""

import inspect
import subprocess
import sys
from typing import Any

import gymnasium
import pytest

import tuckerl
from tests.learners.stepped_worlds import TableEnv
from tests.learners.worlds import corridor
from tuckerl import QLearning, SarsaLambda, TeamQ
from tuckerl.errors import ParameterTypeError
from tuckerl.learners import LEARNERS
from tuckerl.training.habits import HABITS
from tuckerl.training.learner import Learner


@pytest.mark.parametrize(
    ("method", "word"), [(m, w) for m, words in HABITS.items() if m != "constructor" for w in words]
)
def test_words_of_others_are_answered(method: str, word: str) -> None:
    agent = QLearning(corridor(), seed=0)
    arguments = {"predict": (0,)}.get(method, (1,))
    with pytest.raises(ParameterTypeError) as error:
        getattr(agent, method)(*arguments, **{word: 1})
    assert str(error.value) == f"{method}() has no argument {word!r}: {HABITS[method][word]}"
    assert agent.episodes == 0


@pytest.mark.parametrize("word", HABITS["constructor"])
def test_words_of_others_are_answered_by_the_constructor(word: str) -> None:
    for learner in (QLearning, TeamQ):
        with pytest.raises(ParameterTypeError) as error:
            learner(corridor(), **{word: 1})  # type: ignore[arg-type]  # that is what is tried
        assert str(error.value) == f"{learner.__name__} has no parameter {word!r}: {HABITS['constructor'][word]}"


def test_answers_name_what_there_is() -> None:
    # "use name=..." names an argument, "tuckerl.Name" something of the library.
    for method, answers in HABITS.items():
        taken = inspect.signature(QLearning if method == "constructor" else getattr(Learner, method)).parameters
        for word, answer in answers.items():
            assert word not in taken
            name = answer.removeprefix("use ").partition("=")[0].partition(",")[0]
            if answer.startswith("use ") and "of learn()" not in answer:
                assert name in taken, answer
            for part in answer.split("tuckerl.")[1:]:
                assert part.partition("(")[0] in tuckerl.__all__


def test_a_slip_of_the_pen_is_answered() -> None:
    agent = QLearning(corridor(), seed=0)
    with pytest.raises(ParameterTypeError, match=r"learn\(\) has no argument 'episode': did you mean 'episodes'\?"):
        agent.learn(episode=1)  # type: ignore[call-arg]  # that is what is tried
    with pytest.raises(ParameterTypeError, match=r"evaluate\(\) has no argument 'zzz': it takes episodes, env, determ"):
        agent.evaluate(zzz=1)  # type: ignore[call-arg]  # as above


def test_signatures_stay() -> None:
    assert list(inspect.signature(QLearning.learn).parameters) == ["self", "episodes", "steps", "callbacks", "progress"]
    names = ["self", "observation", "state", "episode_start", "deterministic", "action_masks"]
    assert list(inspect.signature(QLearning.predict).parameters) == names
    names = ["self", "episodes", "env", "deterministic", "render", "seed"]
    assert list(inspect.signature(QLearning.evaluate).parameters) == names
    assert QLearning.evaluate.__doc__
    assert QLearning.evaluate.__doc__.startswith("Play episodes apart from learning")


def test_a_policy_by_position_is_refused() -> None:
    with pytest.raises(ParameterTypeError, match="QLearning takes env by position and all else by keyword"):
        QLearning("MlpPolicy", corridor())  # type: ignore[call-arg, arg-type]  # as Stable-Baselines3 has it


@pytest.mark.parametrize("learner", [entry.class_name for entry in LEARNERS])
def test_help_shows_all_parameters(learner: str) -> None:
    kind: Any = getattr(tuckerl, learner)
    lines = (inspect.getdoc(kind) or "").splitlines()
    described = [line.partition(" : ")[0] for line in lines if not line.startswith(" ")]
    for name in inspect.signature(kind).parameters:
        assert described.count(name) == 1, name


def test_what_a_learner_describes_itself_stays() -> None:
    assert "A joint problem: a" in (TeamQ.__doc__ or "")
    assert "How strongly traces last" in (SarsaLambda.__doc__ or "")
    assert "Examples\n--------" in (SarsaLambda.__doc__ or "")


@pytest.mark.slow
def test_there_is_no_help_without_docstrings() -> None:
    program = "import tuckerl; print(tuckerl.QLearning.__doc__)"
    done = subprocess.run([sys.executable, "-OO", "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout == "None\n"


def test_the_environment_is_there_to_be_looked_at() -> None:
    env = TableEnv(corridor())
    assert QLearning(env, seed=0).env is env
    assert QLearning(gymnasium.wrappers.TimeLimit(env, 9), seed=0).env is env
    by_id = QLearning("FrozenLake-v1", seed=0)
    assert by_id.env.spec.id == "FrozenLake-v1"
    assert by_id.env is by_id.env
    arrays = corridor()
    assert QLearning(arrays, seed=0).env is arrays
    with pytest.raises(AttributeError):
        by_id.env = env  # type: ignore[misc]  # that is what is tried


@pytest.mark.parametrize("give", ["instance", "callable"])
def test_vectors_of_environments_are_refused_with_the_way_out(give: str) -> None:
    vector = gymnasium.make_vec("FrozenLake-v1", num_envs=2)
    given: Any = vector if give == "instance" else lambda: vector
    with pytest.raises(ParameterTypeError, match=r"a vector environment: pass the id of a single .* n_agents"):
        QLearning(given, seed=0)
