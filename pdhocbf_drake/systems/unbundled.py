"""Blocks that work out several outputs at once."""

from __future__ import annotations

from collections.abc import Mapping

from pydrake.systems.framework import Diagram, DiagramBuilder, LeafSystem, System
from pydrake.systems.primitives import Selector, SelectorParams


class Unbundled(Diagram):
    """A block written in Python that has one output vector, with a port of its own for each part of it.

    Drake calls Python once for all parts, and its own code takes them apart: a call costs more than what most parts
    take to be worked out. In return every output depends on whatever one of them depends on.

    Input ports:
        those of the block.
    Output ports:
        one for each part.
    """

    def __init__(self, block: LeafSystem, parts: Mapping[str, int]) -> None:
        """
        Args:
            block: has one output port.
            parts: name and size of each part of its vector, in order; what is left behind them is the block's own.
        """
        super().__init__()
        builder = DiagramBuilder()
        builder.AddNamedSystem("block", block)
        for port in map(block.get_input_port, range(block.num_input_ports())):
            builder.ExportInput(port, port.get_name())
        split = builder.AddNamedSystem("parts", _split(block.get_output_port().size(), parts))
        builder.Connect(block.get_output_port(), split.get_input_port())
        for i, name in enumerate(parts):
            builder.ExportOutput(split.get_output_port(i), name)
        builder.BuildInto(self)


def leaf_of(block: System) -> LeafSystem:
    """The block that `Unbundled` was given."""
    return block.GetSubsystemByName("block")


def _split(size: int, parts: Mapping[str, int]) -> Selector:
    """Not a `Demultiplexer`, which works its outputs out anew whenever time goes on, and refuses parts of size 0."""
    params = SelectorParams()
    params.inputs = [SelectorParams.InputPortParams(size=size)]
    outputs, start = [], 0
    for name, count in parts.items():
        entries = [SelectorParams.OutputSelection(input_offset=start + i) for i in range(count)]
        outputs.append(SelectorParams.OutputPortParams(name=name, selections=entries))
        start += count
    params.outputs = outputs
    return Selector(params)
