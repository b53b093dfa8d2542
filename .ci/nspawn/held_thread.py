"""One thread of a process, held as a debugger holds it, while the others go on: a loop that hangs, and
nothing else."""

import ctypes
import os

SEIZE, INTERRUPT = 0x4206, 0x4207
ANY_THREAD = 0x40000000

_ptrace = ctypes.CDLL(None, use_errno=True).ptrace
_ptrace.argtypes = [ctypes.c_long, ctypes.c_long, ctypes.c_void_p, ctypes.c_void_p]
_ptrace.restype = ctypes.c_long


def hold(thread):
    """Stops the thread until it is killed."""
    for request in SEIZE, INTERRUPT:
        if _ptrace(request, thread, None, None) != 0:
            error = ctypes.get_errno()
            raise OSError(error, f"thread {thread} cannot be held: {os.strerror(error)}")
    os.waitpid(thread, ANY_THREAD)


def let_die(thread):
    """Whoever holds a thread hears of its death first; unheard, it would never be over."""
    try:
        os.waitpid(thread, os.WNOHANG | ANY_THREAD)
    except ChildProcessError:
        pass
