"""Pages and figures, each of which may fail without the rest."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager

from pdhocbf_drake.errors import PageWarning, reason


@contextmanager
def page(name: str) -> Iterator[None]:
    """What is raised inside costs this page alone: a `PageWarning` names it, and the reason."""
    try:
        yield
    except Exception as error:
        warnings.warn(PageWarning(f"{name} can't be made: {reason(error)}"), stacklevel=3)
