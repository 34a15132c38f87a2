"""Compile functions once, so that their callers call existing machine code.

By default, numba optimises a function's code again within each of its callers: each of the
dynamics' five levels would take as long as the first. The optimiser cannot inline such calls, but
for functions as large as these that gains nothing.
"""

from functools import wraps

from llvmlite import binding, ir
from numba import njit
from numba.core import cgutils
from numba.extending import lower_builtin, type_callable

from pipelines.effects.kernel import ALLOCATING_NOTHING, address


def compiled_once(signature):
    """Return a decorator that compiles a function of one signature, which allocates nothing.

    Parameters
    ----------
    signature : numba signature
        Types of the arguments and of the result.

    Returns
    -------
    callable
        The decorated function may be called from Python and from compiled code.
    """

    def decorate(function):
        compiled = njit(signature, **ALLOCATING_NOTHING)(function)
        # The signature is part of the name, so that cached code of another version does not match.
        symbol = f"{function.__module__}.{function.__qualname__}{signature}"
        # Callers refer to the machine code by this name; the linker resolves it.
        binding.add_symbol(symbol, address(compiled))

        @wraps(function)
        def call(*arguments):
            return compiled(*arguments)

        @type_callable(call)
        def typed(context):
            @wraps(function)
            def typer(*arguments):
                return signature

            return typer

        @lower_builtin(call, *signature.args)
        def lower(context, builder, signature, arguments):
            kind = context.call_conv.get_function_type(signature.return_type, signature.args)
            there = builder.module.globals.get(symbol) or ir.Function(builder.module, kind, symbol)
            status, value = context.call_conv.call_function(
                builder, there, signature.return_type, signature.args, arguments
            )
            # A division by zero in the callee has to reach the caller as an exception.
            with cgutils.if_unlikely(builder, status.is_error):
                context.call_conv.return_status_propagate(builder, status)
            return value

        return call

    return decorate
