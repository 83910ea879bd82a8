"""What compiles kernels, and what they call."""

import pytest

from tuckerl import _jit


@pytest.mark.compiled
def test_what_is_compiled_is_noticed_once_and_what_is_ready_never() -> None:
    @_jit.kernel
    def more(number: float) -> float:
        return number + 1

    noticed: list[str] = []
    with _jit.compiling_noticed(lambda: noticed.append("now")):
        assert noticed == []
        more(1.0)
        more(1)  # another kind
    assert noticed == ["now"]
    with _jit.compiling_noticed(lambda: noticed.append("again")):
        more(2.0)
    assert "again" not in noticed
