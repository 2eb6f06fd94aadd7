"""Input ports that may be left unconnected."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import Context, InputPort


def value_of(port: InputPort, context: Context) -> np.ndarray | None:
    """The value of an input port, or None where it is left unconnected.

    Most are connected, so that to ask first, at every tick, costs more than the refusal of the others.
    """
    try:
        return port.Eval(context)
    except RuntimeError:  # either it has no value, or what computes it failed
        if port.HasValue(context):
            raise
        return None
