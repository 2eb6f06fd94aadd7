"""What the tests of single blocks do to a context."""

from __future__ import annotations

from pydrake.systems.framework import Context, LeafSystem


def update(block: LeafSystem, context: Context) -> None:
    """Takes the block's discrete update, as at a tick."""
    context.SetDiscreteState(block.EvalUniquePeriodicDiscreteUpdate(context))
