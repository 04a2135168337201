"""
Machine code of each kernel generated once, with that of all functions that it calls.

Numba optimises a compiled function together with everything that it calls, generates machine code
for all of it and wraps it for Python. In a chain of calls the last function goes through this as
often as the chain is long. Here a function that kernels call is translated to LLVM's intermediate
code only; a kernel that Python calls links the code of all, and generates machine code once.

Scalar functions are not even optimised before that. Those with loops over arrays are: the loops
become vectors before they are merged into their callers, without which spectra take some percent
longer.

Half of the time goes into Numba's own Python code, which :mod:`per_obspy.kernels._quick` shortens,
besides leaving out passes for what kernels do not contain.
"""

from typing import Any

from numba.core import event, sigutils, untyped_passes
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import CPUDispatcher
from numba.core.types import unliteral

from per_obspy.kernels._quick import KnownCalls, QuickFlags, kept_garbage, short_error

#: Passes for closures, comprehensions, ``with``, and loops over tuples of several types.
UNUSED_PASSES = {
    untyped_passes.WithLifting,
    untyped_passes.InlineClosureLikes,
    untyped_passes.RewriteDynamicRaises,
    untyped_passes.MakeFunctionToJitFunction,
    untyped_passes.InlineInlinables,
    untyped_passes.FindLiterallyCalls,
    untyped_passes.LiteralUnroll,
    untyped_passes.LiteralPropagationSubPipelinePass,
}


class KernelLibrary(JITCodeLibrary):
    """Code of a kernel, linked with that of all functions that it calls, directly or not."""

    def add_linking_library(self, library: Any) -> None:
        """Add the code of a function that is called, and of those that this one calls."""
        super().add_linking_library(library)
        if isinstance(library, FunctionLibrary):
            self._linking_libraries += library._linking_libraries

    def finalize(self) -> None:
        """Link each library after all that call it, then generate machine code."""
        self._linking_libraries = self._callers_first()
        super().finalize()

    def _callers_first(self) -> list[Any]:
        """Return the libraries, once each, those that call before those that are called."""
        # Code that is not called yet is left out when it is linked. Every mention of a library is
        # followed by one of each library that it calls.
        return list(dict.fromkeys(reversed(self._linking_libraries)))[::-1]


class FunctionLibrary(KernelLibrary):
    """Intermediate code of a function and of those that it calls, optimised."""

    def finalize(self) -> None:
        """Link and optimise; no machine code is generated."""
        for library in self._callers_first():
            self._final_module.link_in(library._get_module_for_linking(), preserve=True)
        self._linking_libraries.clear()
        self._optimize_final_module()
        self._finalized = True


class LeanLibrary(FunctionLibrary):
    """Intermediate code of one function; the functions that it calls are listed, not linked."""

    def _optimize_functions(self, module: Any) -> None:
        """Leave the optimisation to the kernel; only set the layout of data for it."""
        module.data_layout = self._codegen._data_layout

    def finalize(self) -> None:
        """End the changes."""
        self._finalized = True


class LeanPipeline(Compiler):
    """Numba's compiler without what kernels do not need."""

    def compile_extra(self, func: Any) -> Any:
        """Compile a function of Python, with options that compare quickly."""
        self.state.flags = QuickFlags(self.state.flags)
        self.state.typingctx = KnownCalls(self.state.typingctx)
        with kept_garbage(), short_error():
            return super().compile_extra(func)

    def define_pipelines(self) -> Any:
        """Return the passes that kernels need."""
        (passes,) = super().define_pipelines()
        passes.passes = [one for one in passes.passes if one[0] not in UNUSED_PASSES]
        return [passes]


class KernelCompiler(LeanPipeline):
    """Compiler of kernels that Python calls."""

    def define_pipelines(self) -> Any:
        """Return the passes, which write to a library that links all functions."""
        state = self.state
        state.library = KernelLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        # the library is stored on disk later
        state.library.enable_object_caching()
        return super().define_pipelines()


class FunctionCompiler(LeanPipeline):
    """Compiler of functions that kernels call."""

    library = FunctionLibrary

    def define_pipelines(self) -> Any:
        """Return the passes up to intermediate code."""
        state = self.state
        state.library = self.library(state.targetctx.codegen(), state.func_id.func_qualname)
        state.flags.no_compile = True
        state.flags.no_cpython_wrapper = True
        state.flags.no_cfunc_wrapper = True
        return super().define_pipelines()


class LeanCompiler(FunctionCompiler):
    """Compiler of scalar functions."""

    library = LeanLibrary


class LinkedFunction(CPUDispatcher):
    """
    A function that is compiled into the kernels that call it; Python calls a kernel of its own.

    Parameters
    ----------
    kernel : Dispatcher
        The function as a kernel that Python calls, compiled by `KernelCompiler`.
    compiler : type
        `FunctionCompiler` or `LeanCompiler`.
    """

    #: Set by Numba.
    _compiler: Any

    def __init__(self, kernel: Any, compiler: type[FunctionCompiler]) -> None:
        """Take the options of the kernel and its place on disk; compilation waits for a call."""
        options = {"targetoptions": kernel.targetoptions, "pipeline_class": compiler}
        super().__init__(kernel.py_func, **options)
        self.kernel = kernel
        self._cache = kernel._cache
        self._is_optimised_alone = compiler.library is FunctionLibrary

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        """Call the kernel."""
        return self.kernel(*arguments, **named)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Return what the typing of a call needs; one code serves all constants of a type."""
        # Merged into its caller before it is optimised, the code knows the constants of the call
        if not self._is_optimised_alone:
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
            details = {"dispatcher": self, "args": arguments, "return_type": result}
            with event.trigger_event("numba:compile", data=details):
                code = self._compiler.compile(arguments, result)
            # a key in place of the address that no machine code has
            code = code._replace(entry_point=object())
            self.targetctx.insert_user_function(code.entry_point, code.fndesc, [code.library])
            self.overloads[tuple(arguments)] = code
            return code.entry_point
