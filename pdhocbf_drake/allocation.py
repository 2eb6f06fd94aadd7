"""glibc's cache of freed memory, roomy enough for a step of Drake's plant.

A process that simulates one walk gains by it, and one that simulates many does not: what is kept for later use comes to
lie far apart.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from typing import Final

_VARIABLE: Final = "GLIBC_TUNABLES"
_TUNABLE: Final = "glibc.malloc.tcache_count"
_BEGUN: Final = "PDHOCBF_BEGUN"
"""Set in a process that has begun again: where something else removes `_VARIABLE`, it would do so for ever."""
_COUNT: Final = 512
"""Freed pieces of each size that are kept, where glibc keeps 7; from 64 on the time of a walk hardly changes."""


def roomy(environment: Mapping[str, str]) -> dict[str, str]:
    """What is to be added to the environment of a process that simulates once: nothing if it sets the cache already.

    glibc reads it as a process starts, and other libraries of C don't mind. It changes no result.
    """
    given = environment.get(_VARIABLE, "")
    if not sys.platform.startswith("linux") or _TUNABLE in given:
        return {}
    return {_VARIABLE: f"{given}:{_TUNABLE}={_COUNT}".removeprefix(":")}


def begin_again_roomy() -> None:
    """Starts this process anew with the same command and a roomy cache; on Linux only, and once.

    Not where that would be another program: with arguments that aren't those of the process, read from a pipe, or in a
    debugger.
    """
    added, own = roomy(os.environ), sys.argv[1:]
    words = sys.orig_argv
    same = bool(sys.executable) and words[len(words) - len(own) :] == own and sys.argv[0] not in ("", "-")
    if not added or not same or sys.gettrace() is not None or _BEGUN in os.environ:
        return
    try:
        for stream in filter(None, (sys.stdout, sys.stderr)):
            stream.flush()
        os.execve(sys.executable, words, {**os.environ, **added, _BEGUN: "1"})
    except (OSError, ValueError):  # it is slower without, that is all
        return
