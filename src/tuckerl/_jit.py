"""The one door to Numba: how kernels are compiled.

Kernels release the GIL, keep the order of floating-point operations (no ``fastmath``: the slow twins in the tests
must agree to the last bits) and are kept on disk, see `_kernel_cache`; what others wrote, in memory only.
"""

import ctypes
import functools
import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, TypeVar

import numba
import numpy as np
from llvmlite import ir
from numba import types as numba_types
from numba.core import config as numba_config
from numba.core.ccallback import CFunc
from numba.core.errors import NumbaError as NumbaError
from numba.core.event import Listener, install_listener
from numba.extending import intrinsic

from tuckerl._kernel_cache import is_ours as is_ours  # _kernel_cache and _kernel_compiler are for this file alone
from tuckerl._kernel_cache import kept_code
from tuckerl._kernel_compiler import Kernel
from tuckerl._kernel_compiler import passed_whole as passed_whole
from tuckerl.checks import check_python_function
from tuckerl.errors import SimulatorError

_types: Any = numba_types
_Function = TypeVar("_Function", bound=Callable[..., object])


_config: Any = numba_config
_INTERPRETED = bool(_config.DISABLE_JIT)
# Without reference counting (_nrt), which takes most of the time where arrays are passed on in NamedTuples.
_OPTIONS: Any = {
    "nogil": True,
    "_nrt": False,
    "error_model": "numpy",
}


class _FirstCompilation(Listener):
    """Hears of what Numba compiles, which what it finds in the cache is not."""

    def __init__(self, notice: Callable[[], None]) -> None:
        self._notice, self._was_noticed = notice, False

    def on_start(self, event: Any) -> None:
        if not self._was_noticed:
            self._was_noticed = True
            self._notice()

    def on_end(self, event: Any) -> None:
        pass


@contextmanager
def compiling_noticed(notice: Callable[[], None]) -> Iterator[None]:
    """Call `notice` once, when the first kernel in the block begins to be compiled; not if all are in the cache."""
    with install_listener("numba:compile", _FirstCompilation(notice)):
        yield


def kernel(function: _Function) -> _Function:
    """Compile `function` on its first call for each kind of arguments.

    It gets and changes arrays and numbers; it makes no arrays, raises nothing and knows no strings. What other names
    have as values is read when it is compiled. In a user's own file it is compiled anew by every process, with bounds
    checks: a slip must not write where it does not belong.
    """
    check_python_function("a kernel", function)
    return _as_kernel(function, is_inlined=True)


def routine(function: _Function) -> _Function:
    """Compile a kernel that stays apart from those that call it: for long ones, which are compiled sooner so."""
    return _as_kernel(function, is_inlined=False)


def _as_kernel(function: _Function, *, is_inlined: bool) -> _Function:
    if _INTERPRETED:
        return function
    options = {**_OPTIONS, "boundscheck": not is_ours(function), "forceinline": is_inlined}
    compiled: Any = Kernel(function, options, functools.partial(_compiled_for_python, options=options))
    kept: _Function = compiled
    return kept


def _compiled_for_python(function: Callable[..., Any], options: dict[str, Any]) -> Any:
    compiled: Any = numba.njit(**options)(function)
    if is_ours(function):
        compiled._cache = kept_code(function)
    return compiled


def silent(function: _Function) -> _Function:
    """Let numbers leave their range unnoticed in a kernel that is interpreted, too: NumPy would warn of it."""
    if not _INTERPRETED:
        return function
    unnoticed: Any = np.errstate(all="ignore")
    wrapped: _Function = unnoticed(function)
    return wrapped


def recompiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function of a user's own, however it was compiled, as `kernel` compiles it."""
    return kernel(getattr(function, "py_func", function))


class ByKind:
    """A function for kernels to call: the kernel that `kernels` has for the kind of its first argument.

    The choice is made when the caller is compiled, so one body serves all kinds and pays nothing for it.
    """

    is_compiling = False  # Numba asks; the kernel itself knows

    def __init__(self, kernels: Mapping[type, Callable[..., Any]]) -> None:
        self.kernels = kernels
        self._numba_type_ = _types.Dispatcher(self)  # what Numba takes it for

    def __call__(self, first: Any, *others: Any) -> Any:
        """Return what the kernel returns."""
        return self.kernels[type(first)](first, *others)

    def get_call_template(self, arguments: Any, named: Any) -> Any:
        """Return what Numba asks of a kernel when it finds a call."""
        return self._of(arguments).get_call_template(arguments, named)

    def get_overload(self, arguments: Any) -> Any:
        """Return what Numba links to the call."""
        return self._of(arguments).get_overload(arguments)

    def _of(self, arguments: Any) -> Any:
        return self.kernels[arguments[0].instance_class]


@intrinsic
def _call_address(typing_context: Any, address: Any, argument: Any) -> Any:
    """``address(argument)`` for a C function from int64 to int64."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        number = ir.IntType(64)
        function = builder.inttoptr(arguments[0], ir.FunctionType(number, [number]).as_pointer())
        return builder.call(function, [arguments[1]])

    return numba_types.int64(numba_types.int64, numba_types.int64), generate


@intrinsic
def _expect_false(typing_context: Any, condition: Any) -> Any:
    """Let LLVM put what follows from a condition out of the way."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        bit = ir.IntType(1)
        expect = builder.module.declare_intrinsic("llvm.expect", (bit,), ir.FunctionType(bit, [bit, bit]))
        return builder.call(expect, [arguments[0], bit(0)])

    return numba_types.boolean(numba_types.boolean), generate


@kernel
def is_rare(condition: bool) -> bool:
    """Return the condition itself, which is hardly ever true: kernels lose less time with it."""
    return _expect_false(condition)  # type: ignore[call-arg]  # as kernels see it


_Callback = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64)


def python_callback(function: Callable[[int], int]) -> tuple[Any, int]:
    """Return an object to be kept for as long as kernels may call `function`, and the address for `call_python`.

    What is called so cannot raise: the error would be printed, and the kernel would go on.
    """
    callback = _Callback(function)
    address: Any = ctypes.cast(callback, ctypes.c_void_p).value
    return callback, int(address)


@kernel
def call_python(address: int, argument: int) -> int:
    """Call a Python function from a kernel (an eighth of a microsecond)."""
    return _call_address(address, argument)  # type: ignore[call-arg]  # as kernels see it


@intrinsic
def _call_routine(typing_context: Any, address: Any, pointers: Any) -> Any:
    """``address(*pointers)`` for a routine that takes addresses and returns nothing, as Fortran's do."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        number, n = ir.IntType(64), len(signature.args[1])
        function = builder.inttoptr(arguments[0], ir.FunctionType(ir.VoidType(), [number] * n).as_pointer())
        builder.call(function, [builder.extract_value(arguments[1], place) for place in range(n)])
        return context.get_dummy_value()

    return _types.void(_types.int64, _types.UniTuple(_types.int64, len(pointers))), generate


@kernel
def call_routine(address: int, pointers: tuple[int, ...]) -> None:
    """Call a routine that takes addresses only, as Fortran's do, and returns nothing."""
    _call_routine(address, pointers)  # type: ignore[call-arg]  # as kernels see it


_cfunc: Any = numba.cfunc
_CFunc: Any = CFunc
_ARRAY = _types.float64[::1]
_CONSTANTS = _types.Array(_types.float64, 1, "C", readonly=True)
_STREAM = _types.uint64[::1]
_INT, _FLOAT, _BOOL = _types.int64, _types.float64, _types.boolean
_SIGNATURES = {
    "reset": _types.void(_CONSTANTS, _ARRAY, _STREAM),
    "step": _types.Tuple((_FLOAT, _BOOL))(_CONSTANTS, _ARRAY, _INT, _STREAM),
    "index": _INT(_CONSTANTS, _ARRAY),
}
_RETURNS = {
    "reset": "reset(parameters, state, rng) must return nothing",
    "step": "step(parameters, state, action, rng) must return (reward, terminated), a number and a bool",
    "index": "index(parameters, state) must return an int",
}


def call_interpreted(address: int, argument: int) -> int:
    """Call a Python function as a kernel does."""
    return int(_Callback(address)(argument))


def call_routine_interpreted(address: int, pointers: tuple[int, ...]) -> None:
    """Call a routine as a kernel does."""
    ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * len(pointers))(int(address))(*map(int, pointers))


if _INTERPRETED:
    call_python, call_routine = call_interpreted, call_routine_interpreted

    def is_rare(condition: bool) -> bool:
        """Return the condition itself."""
        return condition


def compiled_function(function: Callable[..., Any], role: str) -> Any:
    """Compile one of a simulator's functions to the fixed signature of its role: "reset", "step" or "index".

    Kernels take it as data: they are not compiled again for every simulator.

    Raises
    ------
    SimulatorError
        If it cannot be compiled or returns something of another kind.
    """
    if _INTERPRETED:
        return function
    if is_ours(function):
        return _own_function(function, role)
    return _users_function(function, role)


# Bounds are checked: a slip in a user's function must not write where it does not belong.
_USERS_OPTIONS: Any = {
    "_nrt": False,
    "error_model": "numpy",
    "boundscheck": True,
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
}


_OWN_OPTIONS = {"_nrt": False, "error_model": "numpy"}


@functools.cache
def _own_function(function: Callable[..., Any], role: str) -> Any:
    signature = _SIGNATURES[role]
    compiled = _CFunc(function, (signature.args, signature.return_type), {}, _OWN_OPTIONS)
    compiled._cache = kept_code(function)
    compiled.compile()
    return compiled


def _users_function(function: Callable[..., Any], role: str) -> Any:
    """Compile without a cache (other sources are not in our folder's hash) and within a guard: nothing may raise.

    What is called by its address cannot raise: Numba would print the error and go on.
    """
    signature = _SIGNATURES[role]
    try:
        inner: Any = numba.njit(**_USERS_OPTIONS)(getattr(function, "py_func", function))
        inner.compile(signature.args)
        returned = inner.overloads[signature.args].signature.return_type
        guarded = _cfunc(signature, _nrt=False)(_GUARDS[role](inner)) if _fits(returned, role) else None
    except (NumbaError, TypeError, ValueError, NotImplementedError) as error:
        raise SimulatorError(
            f"the simulator's {role} cannot be compiled: it may use numbers, arrays, math and tuckerl.rng.uniform, and "
            f"{_RETURNS[role]}; Numba's own words are above"
        ) from error
    if guarded is None:
        raise SimulatorError(f"the simulator's {_RETURNS[role]}; it returns {returned}")
    return guarded


def _fits(returned: Any, role: str) -> bool:
    if role == "reset":
        return bool(returned == _types.none)
    if role == "index":
        return isinstance(returned, _types.Integer)
    pair = [_types.unliteral(kind) for kind in returned] if isinstance(returned, _types.BaseTuple) else []
    return len(pair) == 2 and isinstance(pair[0], (_types.Integer, _types.Float)) and pair[1] == _BOOL


def _guard_reset(function: Any) -> Callable[..., Any]:
    def reset(parameters: Any, state: Any, rng: Any) -> None:
        try:
            function(parameters, state, rng)
        except Exception:  # noqa: BLE001  # whatever a user's function raises; Numba knows no other clause
            state[0] = math.nan

    return reset


def _guard_step(function: Any) -> Callable[..., Any]:
    def step(parameters: Any, state: Any, action: int, rng: Any) -> Any:
        try:
            result = function(parameters, state, action, rng)
        except Exception:  # noqa: BLE001  # as above
            result = math.nan, True
        return result

    return step


def _guard_index(function: Any) -> Callable[..., Any]:
    def index(parameters: Any, state: Any) -> Any:
        try:
            row = function(parameters, state)
        except Exception:  # noqa: BLE001  # as above
            row = -1
        return row

    return index


_GUARDS = {"reset": _guard_reset, "step": _guard_step, "index": _guard_index}
