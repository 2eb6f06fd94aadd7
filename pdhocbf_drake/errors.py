"""Errors that users see: one sentence that says what was given, what is allowed and what exists."""

from __future__ import annotations


class PdhocbfError(Exception):
    """Base of every error this package raises on purpose; the command line prints it without a traceback."""


class InputError(PdhocbfError, ValueError):
    """A value given by the user is not usable: the message names it, what is allowed and what exists."""


class ModelError(PdhocbfError, ValueError):
    """A robot model lacks something the controller needs (a file, joint, frame, actuator)."""


class ClusterError(PdhocbfError, RuntimeError):
    """A cluster that was to run something is not there, or went away."""


class RunFolderError(PdhocbfError, OSError):
    """A run folder can't be read or written."""
