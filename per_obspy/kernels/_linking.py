"""
Machine code generated once per kernel that Python calls, with that of all functions it calls.

Numba generates machine code for every compiled function, and again for everything that it calls:
in a chain of calls the last function goes through this as often as the chain is long. Here a
function that kernels call is translated to LLVM's intermediate code only, and a kernel links it.
Compiling takes about half as long. Results do not depend on it: where Numba's internals differ
from those used here, functions are compiled as Numba does by itself.

Internals used (the same in Numba 0.61 to 0.68): the library of a compiler's state (as
``BaseContext.compile_subroutine`` sets it), three flags, ``Dispatcher.compile``, ``finalize`` and
`INTERNALS` of ``JITCodeLibrary``, and the linkage of llvmlite's functions.
"""

from collections.abc import Iterable
from typing import Any, ClassVar

from numba.core import sigutils
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import CPUDispatcher
from numba.core.types import unliteral

#: Members of ``JITCodeLibrary``, looked up before any code waits for its callers: there an error
#: would come too late.
INTERNALS = (
    "_codegen",
    "_final_module",
    "_finalized",
    "_get_module_for_linking",
    "_linking_libraries",
    "_optimize_final_module",
    "_optimize_functions",
    "_shared_module",
)


class FunctionLibrary(JITCodeLibrary):
    """
    Intermediate code of a function alone, linked and optimised with its callers.

    Linked to all that it calls, it would be copied as often as the chain of calls above it is long;
    optimised, everything below it would be optimised again.
    """

    def finalize(self) -> None:
        """Leave all to the callers, of which several may bring this code into one kernel."""
        for function in self.own_code.functions:
            if not function.is_declaration:
                function.linkage = "linkonce_odr"
        self._finalized = True

    @property
    def own_code(self) -> Any:
        """Code of the function, with that of what it calls once a kernel has asked for both."""
        return self._final_module

    def _get_module_for_linking(self) -> Any:
        if self._shared_module is None:
            _link(self._final_module, self._linking_libraries)
        return super()._get_module_for_linking()

    def _optimize_functions(self, module: Any) -> None:
        # Only the layout of data, which all linked modules share
        module.data_layout = self._codegen._data_layout


class VectorLibrary(JITCodeLibrary):
    """Intermediate code of a function and of all that it calls, optimised."""

    def finalize(self) -> None:
        """Link and optimise; no machine code is generated."""
        _link(self._final_module, self._linking_libraries)
        self._optimize_final_module()
        self._finalized = True


def _link(module: Any, libraries: Iterable[Any]) -> None:
    """Link some libraries, and all that they call, to a module."""
    parts: dict[Any, None] = {}
    _collect(libraries, parts)
    # Callers first: code that nothing asks for yet would be left out
    for part in reversed(parts):
        is_own = isinstance(part, FunctionLibrary)
        code = part.own_code if is_own else part._get_module_for_linking()
        module.link_in(code, preserve=True)


def _collect(libraries: Iterable[Any], parts: dict[Any, None]) -> None:
    """Add libraries, each after those that it calls."""
    for library in libraries:
        if library not in parts:
            if isinstance(library, FunctionLibrary):
                _collect(library._linking_libraries, parts)
            parts[library] = None


class FunctionCompiler(Compiler):
    """Numba's compiler up to intermediate code."""

    library: ClassVar[type[JITCodeLibrary]] = FunctionLibrary

    def define_pipelines(self) -> Any:
        """Return the passes, which write to a library of this class."""
        state = self.state
        state.library = self.library(state.targetctx.codegen(), state.func_id.func_qualname)
        # Without one of them kernels would lack code: the function is left to Numba
        members = {*dir(JITCodeLibrary), *vars(state.library)}
        if not members.issuperset(INTERNALS):
            raise NotImplementedError(f"Numba without {set(INTERNALS) - members}")
        state.flags.no_compile = True
        state.flags.no_cpython_wrapper = True
        state.flags.no_cfunc_wrapper = True
        return super().define_pipelines()


class LeanCompiler(FunctionCompiler):
    """The same for functions of which one code serves all constants of a type."""


class VectorCompiler(FunctionCompiler):
    """The same for loops that become vectors before they are merged into their callers."""

    library = VectorLibrary


class LinkedFunction(CPUDispatcher):
    """
    A function that is compiled into the kernels that call it; Python calls a kernel of its own.

    Parameters
    ----------
    kernel : Dispatcher
        The function as a kernel that Python calls.
    compiler : type
        `FunctionCompiler`, `LeanCompiler` or `VectorCompiler`.
    """

    #: Set by Numba.
    _compiler: Any

    def __init__(self, kernel: Any, compiler: type[FunctionCompiler]) -> None:
        """Take the options of the kernel and its place on disk; compilation waits for a call."""
        super().__init__(
            kernel.py_func, targetoptions=kernel.targetoptions, pipeline_class=compiler
        )
        self.kernel = kernel
        self._cache = kernel._cache
        self._is_lean = compiler is LeanCompiler

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        """Call the kernel."""
        return self.kernel(*arguments, **named)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Return what the typing of a call needs; one lean code serves all constants of a type."""
        # Merged into its caller before it is optimised, the code knows the constants of the call
        if self._is_lean:
            args = tuple(map(unliteral, args))
            kws = {name: unliteral(kind) for name, kind in kws.items()}
        return super().get_call_template(args, kws)

    def compile(self, sig: Any) -> Any:
        """Compile for a signature, once; return the key by which a call finds the code."""
        arguments, result = sigutils.normalize_signature(sig)
        with global_compiler_lock, self._compiling_counter:
            known: Any = self.overloads.get(tuple(arguments))
            if known is not None:
                return known.entry_point
            try:
                # A key in place of the address that no machine code has
                code = self._compiler.compile(arguments, result)._replace(entry_point=object())
                self.targetctx.insert_user_function(code.entry_point, code.fndesc, [code.library])
            except (AssertionError, AttributeError, NotImplementedError, TypeError):
                # Another Numba: the function with machine code of its own
                self.kernel.compile(sig)
                code = self.kernel.overloads[tuple(arguments)]
            self.overloads[tuple(arguments)] = code
            return code.entry_point
