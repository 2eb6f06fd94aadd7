"""Blocks that work out several outputs at once."""

from __future__ import annotations

from collections.abc import Mapping

from pydrake.systems.framework import Diagram, DiagramBuilder, LeafSystem
from pydrake.systems.primitives import Selector, SelectorParams


class Unbundled(Diagram):
    """A block written in Python that has one output vector, with a port of its own for each part of it.

    Drake calls Python once for all parts, and its own code takes them apart: a call costs more than what most parts
    take to be worked out.

    Input ports:
        those of the block.
    Output ports:
        one for each part.

    Attributes:
        block: the block itself.
    """

    def __init__(self, block: LeafSystem, parts: Mapping[str, int]) -> None:
        """
        Args:
            block: has one output port.
            parts: name and size of each part of its vector, in order.
        """
        super().__init__()
        self.block = block
        builder = DiagramBuilder()
        builder.AddNamedSystem("block", block)
        for port in map(block.get_input_port, range(block.num_input_ports())):
            builder.ExportInput(port, port.get_name())
        split = builder.AddNamedSystem("parts", _split(parts))
        builder.Connect(block.get_output_port(), split.get_input_port())
        for i, name in enumerate(parts):
            builder.ExportOutput(split.get_output_port(i), name)
        builder.BuildInto(self)


def _split(parts: Mapping[str, int]) -> Selector:
    """Not a `Demultiplexer`, which would take time for something that its outputs depend on."""
    params = SelectorParams()
    params.inputs = [SelectorParams.InputPortParams(size=sum(parts.values()))]
    outputs, start = [], 0
    for name, size in parts.items():
        entries = [SelectorParams.OutputSelection(input_offset=start + i) for i in range(size)]
        outputs.append(SelectorParams.OutputPortParams(name=name, selections=entries))
        start += size
    params.outputs = outputs
    return Selector(params)
