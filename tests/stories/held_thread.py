"""Holds one thread of a process, as a debugger does, while the others continue: simulates a loop that hangs
alone."""

import ctypes
import os

SEIZE, INTERRUPT = 0x4206, 0x4207
ANY_THREAD = 0x40000000

_ptrace = ctypes.CDLL(None, use_errno=True).ptrace
_ptrace.argtypes = [ctypes.c_long, ctypes.c_long, ctypes.c_void_p, ctypes.c_void_p]
_ptrace.restype = ctypes.c_long


def hold(thread):
    """Stops the thread until this holder is killed."""
    for request in SEIZE, INTERRUPT:
        if _ptrace(request, thread, None, None) != 0:
            error = ctypes.get_errno()
            raise OSError(error, f"thread {thread} cannot be held: {os.strerror(error)}")
    os.waitpid(thread, ANY_THREAD)


def has_died(thread):
    """Whether a held thread that was killed has ended. It and its process remain zombies until the holder has waited
    for it: call again until this is true."""
    try:
        return os.waitpid(thread, os.WNOHANG | ANY_THREAD)[0] == thread
    except ChildProcessError:
        return True
