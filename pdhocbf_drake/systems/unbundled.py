"""A block with one output vector as a diagram with an output port for each part of that vector."""

from __future__ import annotations

from pydrake.systems.framework import Diagram, DiagramBuilder, LeafSystem, System
from pydrake.systems.primitives import Selector, SelectorParams

_LEAF = "leaf"


def unbundled(leaf: LeafSystem) -> Diagram:
    """The block with the output ports `leaf.parts`, in place of its first output vector.

    Drake calls a block's Python once for the whole vector, and its own code selects the parts: a call costs more than
    the computation of most parts. In return every part is recomputed when any of them may have changed.

    Input ports:
        those of the block.
    Output ports:
        one for each part; then the block's other ones as they are.

    Args:
        leaf: a block with `parts`, the name and size of each part of its first output port's vector in order; the
            elements behind the last part stay inside the block.
    """
    builder = DiagramBuilder()
    builder.AddNamedSystem(_LEAF, leaf)
    for port in map(leaf.get_input_port, range(leaf.num_input_ports())):
        builder.ExportInput(port, port.get_name())
    # Not a Demultiplexer, whose outputs are recomputed whenever time advances, and which refuses parts of size 0.
    params = SelectorParams()
    params.inputs = [SelectorParams.InputPortParams(size=leaf.get_output_port(0).size())]
    outputs, start = [], 0
    for name, size in leaf.parts.items():
        elements = [SelectorParams.OutputSelection(input_offset=start + i) for i in range(size)]
        outputs.append(SelectorParams.OutputPortParams(name=name, selections=elements))
        start += size
    params.outputs = outputs
    selector = builder.AddNamedSystem("parts", Selector(params))
    builder.Connect(leaf.get_output_port(0), selector.get_input_port())
    for i, name in enumerate(leaf.parts):
        builder.ExportOutput(selector.get_output_port(i), name)
    for port in map(leaf.get_output_port, range(1, leaf.num_output_ports())):
        builder.ExportOutput(port, port.get_name())
    return builder.Build()


def leaf_of(block: System) -> LeafSystem:
    """The block that `unbundled` was given."""
    return block.GetSubsystemByName(_LEAF)
