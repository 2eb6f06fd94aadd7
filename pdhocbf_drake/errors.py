"""Errors for users: one sentence with the value given, the allowed ones and those that exist."""

from __future__ import annotations


class PdhocbfError(Exception):
    """Base of all errors of this package; the command line prints them without a traceback."""


class InputError(PdhocbfError, ValueError):
    """A value given by the user is not allowed."""


class ModelError(PdhocbfError, ValueError):
    """A robot model lacks a file, joint, frame or actuator that the controller needs."""


class ClusterError(PdhocbfError, RuntimeError):
    """A cluster can't be reached, or its connection was lost."""


class RunFolderError(PdhocbfError, OSError):
    """A run folder can't be read or written."""


class PageWarning(UserWarning):
    """A page, figure or part of a study is missing, since it can't be made; all other results are there."""


def reason(error: BaseException) -> str:
    """The reason in one sentence: an error's message, with its type where that is no error for users."""
    if isinstance(error, KeyboardInterrupt):
        return "interrupted"
    if isinstance(error, OSError) and error.strerror:
        return error.strerror
    first = (str(error).strip().splitlines() or ["no message"])[0]
    return first if isinstance(error, PdhocbfError) else f"unexpected {type(error).__name__}: {first}"
