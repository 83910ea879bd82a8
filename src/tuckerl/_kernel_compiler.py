"""How Numba compiles kernels that kernels call: into their callers, with no machine code of their own.

Numba makes of every function one that Python can call, optimises it and writes its machine code, though ours are
compiled again as a part of their callers. To leave that out takes a third off the time until the first result. Where
Python does call a kernel, it is compiled in Numba's own way.
"""

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numba
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import register_pass
from numba.core.registry import CPUDispatcher
from numba.core.typed_passes import NativeLowering

_Base: Any = NativeLowering
_CompilerBase: Any = CompilerBase
_Dispatcher: Any = CPUDispatcher
_PassBuilder: Any = DefaultPassBuilder
_numba: Any = numba
_make_function: Any = _numba._dynfunc.make_function
_register: Any = register_pass


@_register(mutates_CFG=True, analysis_only=False)
class _LoweringWithoutCode(_Base):  # type: ignore[misc]  # Numba has no types
    """Makes LLVM's representation of a kernel, for its callers to link."""

    _name = "lowering_without_code"

    def run_pass(self, state: Any) -> bool:
        state.flags.no_compile = True
        super().run_pass(state)
        lowered = state["cr"]
        name, env, library = lowered.fndesc.qualname, lowered.env, state.library
        # It stands for what Python would call, which nobody does: its address is none.
        key = _make_function(lowered.fndesc.lookup_module(), name, "", 0, env, (library,))
        state.targetctx.insert_user_function(key, lowered.fndesc, [state.library])
        state["cr"] = lowered._replace(cfunc=key)
        return True


class InnerCompiler(_CompilerBase):  # type: ignore[misc]  # Numba has no types
    """Numba's compiler but for its last step."""

    def define_pipelines(self) -> list[Any]:
        """Return the passes."""
        passes = _PassBuilder.define_nopython_pipeline(self.state)
        passes.passes = [
            (_LoweringWithoutCode if kind is NativeLowering else kind, text) for kind, text in passes.passes
        ]
        return [passes]


class Kernel(_Dispatcher):  # type: ignore[misc]  # Numba has no types
    """A function that kernels call, and Python as well.

    Parameters
    ----------
    function : callable
    options : dict
        Numba's.
    make_callable : callable
        Compiles the function for Python.
    """

    def __init__(
        self, function: Callable[..., Any], options: dict[str, Any], make_callable: Callable[..., Any]
    ) -> None:
        inner = options | {"nopython": True, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
        super().__init__(function, targetoptions=inner, pipeline_class=InnerCompiler)
        self._make_callable = make_callable

    @cached_property
    def for_python(self) -> Any:
        """The same function as Python calls it."""
        return self._make_callable(self.py_func)

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        """Return what the function returns."""
        return self.for_python(*arguments, **named)

    def add_overload(self, result: Any) -> None:
        """Keep what was compiled, for kernels alone."""
        self.overloads[tuple(result.signature.args)] = result
