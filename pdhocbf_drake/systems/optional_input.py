"""An input port that may be left unconnected."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import Context, InputPort


class OptionalInput:
    """Reads a vector port in one call of Drake where it has a value, since `HasValue` evaluates it as well.

    Attributes:
        port: the port.
    """

    def __init__(self, port: InputPort) -> None:
        self.port, self._given = port, False

    def __call__(self, context: Context) -> np.ndarray | None:
        """The port's value in a context of its block; None where there is none."""
        if self._given:
            try:
                value: np.ndarray = self.port.Eval(context)
            except RuntimeError:  # of this port, unless it has a value that could not be computed
                if self.port.HasValue(context):
                    raise
            else:
                return value
        self._given = self.port.HasValue(context)
        return self.port.Eval(context) if self._given else None
