"""glibc's cache of freed memory, roomy enough for a step of Drake's plant."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from typing import Final

_VARIABLE: Final = "GLIBC_TUNABLES"
_TUNABLE: Final = "glibc.malloc.tcache_count"
_COUNT: Final = 512
"""Freed pieces of each size that are kept, where glibc keeps 7: a contact solve asks for some hundreds."""


def roomy(environment: Mapping[str, str]) -> dict[str, str]:
    """What is to be added to the environment of a process that simulates: nothing if it sets the cache already.

    glibc reads it as a process starts, and other libraries of C don't mind. It changes no result.
    """
    given = environment.get(_VARIABLE, "")
    if not sys.platform.startswith("linux") or _TUNABLE in given:
        return {}
    return {_VARIABLE: f"{given}:{_TUNABLE}={_COUNT}".removeprefix(":")}


def begin_again_roomy() -> None:
    """Starts this process anew with the same command and a roomy cache, unless it has one; on Linux only."""
    added = roomy(os.environ)
    if not added or not sys.executable:
        return
    try:
        os.execve(sys.executable, sys.orig_argv, {**os.environ, **added})
    except OSError:  # it is slower without, that is all
        return
