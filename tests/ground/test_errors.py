"""Errors: all are a TuckerlError, and the built-in kind that each specialises."""

import pytest

from tuckerl import errors

BUILT_IN = {
    "ParameterError": ValueError,
    "ParameterTypeError": TypeError,
    "UnknownNameError": ValueError,
    "TensorError": ValueError,
    "ProblemError": ValueError,
    "MazeError": ValueError,
    "SavedFileError": ValueError,
    "OutputError": OSError,
    "OutputConflictError": FileExistsError,
    "RankWarning": UserWarning,
    "ZeroWeightWarning": UserWarning,
    "DivergenceWarning": RuntimeWarning,
}


@pytest.mark.parametrize("name", BUILT_IN)
def test_each_is_the_built_in_kind_it_specialises(name: str) -> None:
    kind = getattr(errors, name)
    assert issubclass(kind, BUILT_IN[name])
    assert issubclass(kind, errors.TuckerlError) is not issubclass(kind, Warning)


def test_every_one_is_documented_and_of_a_built_in_kind() -> None:
    kinds = [kind for kind in vars(errors).values() if isinstance(kind, type) and kind.__module__ == errors.__name__]
    kinds.remove(errors.TuckerlError)
    assert {kind.__name__ for kind in kinds} >= set(BUILT_IN)
    for kind in kinds:
        assert kind.__doc__
        built_in = [base for base in kind.__mro__ if base.__module__ == "builtins" and base not in (Exception, object)]
        assert [base for base in built_in if base is not BaseException and base is not Warning], kind


@pytest.mark.parametrize("error", [errors.ParameterError, errors.OutputError, errors.MissingExtraError])
def test_no_message_is_longer_than_can_be_read(error: type[errors.TuckerlError]) -> None:
    said = f"it must be this; got {'x' * 10_000}: do that instead"
    message = str(error(said))
    assert len(message) <= 600
    assert message.startswith("it must be this; got xxx")
    assert message.endswith("xxx: do that instead")
    assert str(error("short")) == "short"
