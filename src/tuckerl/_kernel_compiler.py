"""How Numba compiles kernels that kernels call: into their callers, with no machine code of their own.

Numba makes of every function one that Python can call: it optimises the function with all that it calls, and writes its
machine code, though ours are compiled again as a part of their callers. And it hands every number of a NamedTuple on as
an argument of its own: an agent is some two hundred. To leave out both halves the time until the first result. Where
Python does call a kernel, it is compiled in Numba's own way.
"""

from collections.abc import Callable
from functools import cached_property
from typing import Any, TypeVar

import numba
from numba.core import types as numba_types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import register_pass
from numba.core.datamodel.models import TupleModel
from numba.core.registry import CPUDispatcher
from numba.core.typed_passes import NativeLowering
from numba.extending import register_model, typeof_impl

_Base: Any = NativeLowering
_CompilerBase: Any = CompilerBase
_Dispatcher: Any = CPUDispatcher
_Library: Any = JITCodeLibrary
_PassBuilder: Any = DefaultPassBuilder
_TupleModel: Any = TupleModel
_numba: Any = numba
_make_function: Any = _numba._dynfunc.make_function
_register: Any = register_pass
_register_model: Any = register_model
_typeof: Any = typeof_impl
_types: Any = numba_types

_Arrays = TypeVar("_Arrays", bound=type)


class _InnerLibrary(_Library):  # type: ignore[misc]  # Numba has no types
    """LLVM's representation of a kernel and of all that it calls, which is neither optimised nor made machine code."""

    def finalize(self) -> None:
        """Put in what the kernel calls."""
        for library in dict.fromkeys(self._linking_libraries):
            self._reload_init.update(library._reload_init)
            self._final_module.link_in(library._get_module_for_linking(), preserve=True)
        self._finalized = True


@_register(mutates_CFG=True, analysis_only=False)
class _LoweringWithoutCode(_Base):  # type: ignore[misc]  # Numba has no types
    """Makes LLVM's representation of a kernel, for its callers to link."""

    _name = "lowering_without_code"

    def run_pass(self, state: Any) -> bool:
        state.flags.no_compile = True
        state.library = _InnerLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        super().run_pass(state)
        lowered = state["cr"]
        name, env, library = lowered.fndesc.qualname, lowered.env, state.library
        # It stands for what Python would call, which nobody does: its address is none.
        key = _make_function(lowered.fndesc.lookup_module(), name, "", 0, env, (library,))
        state.targetctx.insert_user_function(key, lowered.fndesc, [state.library])
        state["cr"] = lowered._replace(cfunc=key)
        return True


class _InnerCompiler(_CompilerBase):  # type: ignore[misc]  # Numba has no types
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
        super().__init__(function, targetoptions=inner, pipeline_class=_InnerCompiler)
        self._make_callable = make_callable

    @cached_property
    def for_python(self) -> Any:
        """The same function as Python calls it."""
        return self._make_callable(self.py_func)

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        """Return what the function returns."""
        return self.for_python(*arguments, **named)

    def get_call_template(self, arguments: Any, named: Any) -> Any:
        """Return what the caller's types are inferred from; ``0`` is not another type than ``1``, as to Numba."""
        return super().get_call_template([_types.unliteral(kind) for kind in arguments], named)

    def add_overload(self, result: Any) -> None:
        """Keep what was compiled, for kernels alone."""
        self.overloads[tuple(result.signature.args)] = result


class _WholeTuple(_types.NamedTuple):  # type: ignore[misc]  # Numba has no types
    """Numba's type of a NamedTuple that is one argument."""


@_register_model(_WholeTuple)
class _WholeTupleModel(_TupleModel):  # type: ignore[misc]  # Numba has no types
    """As of any tuple, but for how it is handed on."""

    def get_argument_type(self) -> Any:
        return self.get_value_type()

    def as_argument(self, builder: Any, value: Any) -> Any:
        return value

    def from_argument(self, builder: Any, value: Any) -> Any:
        return value


def passed_whole(arrays: _Arrays) -> _Arrays:
    """Let kernels hand on a NamedTuple of many numbers and arrays as one argument: a decorator of its class."""

    def typeof(value: Any, context: Any) -> Any:
        members = [_typeof(member, context) for member in value]
        return None if None in members else _WholeTuple(members, arrays)  # None: Numba knows no type for it

    _typeof.register(arrays)(typeof)
    return arrays
