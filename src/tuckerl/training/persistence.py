"""Saving a learner to a file and loading it again, to go on to the last bit.

What code is, no file holds: functions, and environments that are not known by an id, are given again to `load`. What a
file holds is checked as constructors check it, whoever wrote it, before anything plays; and what could not be read
again is not written.
"""

from collections.abc import Iterable, Mapping
from contextlib import nullcontext
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, NotRequired, TypedDict, TypeVar

import numpy as np

from tuckerl._version import __version__
from tuckerl.adapters.kinds import restore_problem, save_problem
from tuckerl.adapters.resolve import Environment, check_compiled
from tuckerl.checks import shown
from tuckerl.errors import ParameterError, ParameterTypeError, SavedFileError
from tuckerl.generalization.snapshots import one_number
from tuckerl.generalization.tensor_step import TensorStep
from tuckerl.rng import restore_generator
from tuckerl.saved_arrays import SavedArrays, grouped
from tuckerl.saved_json import checked_json
from tuckerl.training import learner_file, old_formats
from tuckerl.training.held_state import HeldState
from tuckerl.training.learner_file import Arrays, Header, reading
from tuckerl.training.parameter_json import check_array, of_json, to_json
from tuckerl.training.parameters import NOT_SAVED, check_takes_seed, kept_parameters, keywords_of
from tuckerl.training.training_state import TrainingState

if TYPE_CHECKING:
    from tuckerl.training.learner import Learner

_Learner = TypeVar("_Learner", bound="Learner")


class _StoredSeed(TypedDict):
    entropy: int | list[int]
    spawn_key: list[int]


class _StoredHeader(TypedDict):
    tuckerl: str
    learner: str
    problem: dict[str, Any]
    parameters: dict[str, Any]
    tensor_step: dict[str, Any] | None
    seed: _StoredSeed
    prediction_rng: dict[str, Any]
    diverged_at: int | None
    worlds: NotRequired[list[dict[str, Any]]]  # format 1 had none


class SavedLearner(NamedTuple):
    """The content of a learner's file."""

    path: Path
    header: Header
    arrays: SavedArrays
    version: int

    @property
    def seed(self) -> np.random.SeedSequence:
        """The learner's seed."""
        return np.random.SeedSequence(self.header["seed"]["entropy"], spawn_key=self.header["seed"]["spawn_key"])

    def is_of(self, kind: "type[Learner]") -> bool:
        """Return whether the file holds a learner of a class."""
        held, own = self.header["learner"], class_name(kind)
        if self.version < learner_file.FORMAT_VERSION:
            return bool(held == kind.__name__)
        module, _, name = held.rpartition(":")
        same_name = name == own.rpartition(":")[2]
        run_as_script = "__main__" in (module, kind.__module__) and ":" in own  # by another name elsewhere
        return bool(held == own or (module and same_name and run_as_script))


def class_name(kind: type) -> str:
    """Return what files call a class of learners: its name, with its module before it where it is a user's own."""
    is_ours = kind.__module__.startswith("tuckerl.")
    return kind.__name__ if is_ours else f"{kind.__module__}:{kind.__qualname__}"


def read(path: Path) -> SavedLearner:
    """Return the content of a learner's file; see :func:`tuckerl.training.learner_file.read` for the errors."""
    content = learner_file.read(path)
    with reading(path):
        header = content.header
        if content.version < learner_file.FORMAT_VERSION:
            header = old_formats.new_header(header)
            old_formats.rename_arrays(content.arrays, content.version)
        checked_json(header, _StoredHeader, "the header")
        saved = SavedLearner(path, header, content.arrays, content.version)
        saved.seed.generate_state(1)  # whatever is wrong with it is said here
    return saved


def plain_parameters(learner: "Learner") -> dict[str, Any]:
    """Return a learner's constructor parameters that are no arrays, by name."""
    return {name: value for name, value in kept_parameters(learner).items() if not isinstance(value, np.ndarray)}


def save(learner: "Learner", state: TrainingState, prediction_rng: np.random.Generator, path: Path) -> None:
    """Write a learner into a file.

    Raises
    ------
    OutputError
        If it cannot be written.
    ParameterError
        If a parameter has a value that no file can hold.
    LearnerError
        If the learner's constructor takes no seed.
    SavedFileError
        If the learner is none that could be loaded: its tables or declared arrays are not what they must be.
    """
    check_takes_seed(type(learner))
    problem_header, problem_arrays = save_problem(learner.problem)
    parameters = {name: to_json(name, value) for name, value in plain_parameters(learner).items()}
    arrays = _array_parameters(learner)
    if "initial_q" in arrays and (first := one_number(arrays["initial_q"])) is not None:
        parameters["initial_q"] = first
        del arrays["initial_q"]
    header = {
        "tuckerl": __version__,
        "learner": class_name(type(learner)),
        "problem": problem_header,
        "parameters": parameters,
        "tensor_step": _stored_step(learner.tensor_step),
        "seed": _stored_seed(learner.seed_sequence),
        "prediction_rng": prediction_rng.bit_generator.state,
        "diverged_at": state.diverged_at,
        "worlds": [world.saved() for world in state.worlds],
    }
    held = state.to_arrays()
    try:
        state.read(SavedArrays.of(held), state.diverged_at)
    except SavedFileError as error:
        raise SavedFileError(f"{path} was not written, as it could not be loaded again: {error}") from error
    learner_file.write(path, header, grouped("problem", problem_arrays) | grouped("parameters", arrays) | held)


def _array_parameters(learner: "Learner") -> Arrays:
    """Return a learner's constructor parameters that are arrays."""
    arrays = {name: value for name, value in kept_parameters(learner).items() if isinstance(value, np.ndarray)}
    for name, array in arrays.items():
        check_array(name, array)
    return arrays


def load(
    kind: type[_Learner],
    saved: SavedLearner,
    *,
    env: Environment | None,
    tensor_step: TensorStep | None,
    changes: Mapping[str, Any],
) -> _Learner:
    """Return the learner that a file holds; see :meth:`tuckerl.training.learner.Learner.load` for the errors."""
    path, header, arrays, _ = saved
    if not saved.is_of(kind):
        held, own = _described(header["learner"]), _described(class_name(kind))
        raise SavedFileError(f"{path} holds a {held}, not a {own}: load it with {_short_name(header['learner'])}.load")
    kind.check_changes(changes)
    with reading(path):
        parameters = _restored_parameters(kind, saved)
        options = kind.adapter_options(parameters)
        check_compiled(options.compiled)  # here, as it is the file's, which an environment's fault is not
    # What is wrong with an environment that was given is no fault of the file.
    with reading(path) if env is None else nullcontext():
        problem = restore_problem(header["problem"], arrays.group("problem"), env, path, options)
    with reading(path):
        n_agents = problem.n_tables(parameters.get("n_agents", 1))
        _check_agents(arrays, n_agents)  # before as many are made
        parameters |= _array_parameters_of(kind, saved, set(parameters), (problem.n_states, problem.n_actions))
    step = _restored_step(header["tensor_step"], tensor_step, path)
    with reading(path):
        parameters |= {"seed": saved.seed} if step is None else {"seed": saved.seed, "tensor_step": step}
        learner = kind(problem, **parameters)
        learner.restore(saved)
        arrays.check_all_taken()
    learner.change(changes)
    return learner


def _short_name(held: str) -> str:
    return held.rpartition(":")[2]


def _described(held: str) -> str:
    """Return a class's name, with its module where it is a user's own."""
    module = held.rpartition(":")[0]
    return f"{_short_name(held)} of the module {module}" if module else held


def restore(saved: SavedLearner, state: TrainingState, prediction_rng: np.random.Generator) -> None:
    """Let a new learner's state go on from the content of its file.

    Raises
    ------
    ParameterTypeError
        If it is no such content.
    SavedFileError
        If it holds what no such learner has.
    """
    if not isinstance(saved, SavedLearner):
        raise ParameterTypeError(f"restore() takes what load() has read of a file; got {shown(saved)}")
    held = read_state(saved, state)
    restore_generator(prediction_rng, saved.header["prediction_rng"])
    worlds = saved.header.get("worlds", [{} for _ in state.worlds])
    if len(worlds) != len(state.worlds):
        raise SavedFileError(f"it must hold {len(state.worlds)} worlds; it holds {len(worlds)}")
    for world, own in zip(state.worlds, worlds, strict=True):
        world.restore(own)
    state.restore(held)


def read_state(saved: SavedLearner, state: TrainingState) -> HeldState:
    """Return what a file holds of what `state` has, checked; nothing goes on from it.

    Raises
    ------
    SavedFileError
        If it holds what no such learner has.
    """
    if saved.version < learner_file.FORMAT_VERSION:
        old_formats.rename_declared(saved.arrays, state.declarations, state.n_agents)
        saved.arrays.leave_out(*(f"agents/{agent}/action_mask" for agent in range(state.n_agents)))
    return state.read(saved.arrays, saved.header["diverged_at"])


def _check_agents(arrays: SavedArrays, n_agents: int) -> None:
    """Refuse a file that holds another number of agents than its parameters say."""
    held = {name.partition("/")[0] for name in arrays.group("agents")}
    if len(held) != n_agents:
        raise SavedFileError(f"it must hold {n_agents} agents; it holds {len(held)}")


def _stored_seed(sequence: np.random.SeedSequence) -> Header:
    """Return what makes `sequence` again."""
    entropy: Any = sequence.entropy
    words = [int(word) for word in entropy] if isinstance(entropy, Iterable) else int(entropy)
    return {"entropy": words, "spawn_key": [int(key) for key in sequence.spawn_key]}


def _stored_step(step: TensorStep | None) -> Header | None:
    """Return a tensor step's parameters; None stands for a user's function, which a file of data cannot hold."""
    if step is None:
        return None
    parameters = {field.name: getattr(step, field.name) for field in fields(step)}
    return {name: None if callable(value) else value for name, value in parameters.items()}


def _restored_step(header: Header | None, given: TensorStep | None, path: Path) -> TensorStep | None:
    """Return the tensor step that `_stored_step` returned, with the functions of the one `given` in its place.

    Raises
    ------
    SavedFileError
        If functions are needed and none is given, or it holds no tensor step's parameters.
    ParameterError
        If the one given differs in anything but those functions, or none is needed.
    """
    functions = [] if header is None else [name for name in ("weights", "share") if header.get(name, "") is None]
    if header is not None:
        with reading(path):  # a function in the place of each, to check what stands beside it
            whole = TensorStep(**(header | dict.fromkeys(functions, _any_function)))
    if given is None:
        if functions:
            raise SavedFileError(
                f"{path} used a tensor step with functions of its own ({', '.join(functions)}), which files cannot "
                "hold: pass load() a tensor_step with them"
            )
        return None if header is None else whole
    if header is None or not functions:
        raise ParameterError(f"{path} holds all of its tensor step: load it without tensor_step")
    for name, value in header.items():
        now = getattr(given, name)
        was_function = name in functions
        same = callable(now) if was_function else now == (tuple(value) if isinstance(value, list) else value)
        if not same:
            before = "a function" if was_function else repr(value)
            raise ParameterError(
                f"tensor_step must be the one that {path} was saved with: its {name} was {before}; got {shown(now)}"
            )
    return given


def _any_function(_: Any) -> Any:
    raise NotImplementedError


def _restored_parameters(kind: "type[Learner]", saved: SavedLearner) -> dict[str, Any]:
    """Return the parameters that are no arrays, of those that a learner was saved with and its class takes."""
    header: Mapping[str, Any] = saved.header["parameters"]
    known = [name for name in keywords_of(kind) if name not in NOT_SAVED]
    if saved.version < learner_file.FORMAT_VERSION:
        header = old_formats.new_parameters(kind, header)
        saved.arrays.rename({name: f"parameters/{name}" for name in known if name not in header})
    unknown = [name for name in (*header, *saved.arrays.group("parameters")) if name not in known]
    if unknown:
        raise SavedFileError(f"{class_name(kind)} has no parameter {unknown[0]!r:.60}")
    parameters = {name: of_json(value) for name, value in header.items()}
    if parameters.get("policy") is not None:
        parameters["epsilon"] = None
    return parameters


def _array_parameters_of(
    kind: "type[Learner]", saved: SavedLearner, others: set[str], sizes: tuple[int, int]
) -> dict[str, Any]:
    """Return the parameters that are arrays; those of tuckerl's own are (S,) or (S, A), or one number in old files."""
    ours = keywords_of(next(base for base in kind.__mro__ if base.__module__.startswith("tuckerl.")))
    arrays, is_old, found = saved.arrays.group("parameters"), saved.version < learner_file.FORMAT_VERSION, {}
    for name in list(arrays):
        shape = arrays.shape(name)
        if name in others or (name in ours and shape not in (sizes, sizes[:1], () if is_old else sizes)):
            raise SavedFileError(f"the parameter {shown(name)} is there twice, or has the impossible shape {shape}")
        array = arrays[name]
        found[name] = array[()].item() if is_old and array.ndim == 0 else array
    return found
