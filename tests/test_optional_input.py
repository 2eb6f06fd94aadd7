"""Input ports that may be left unconnected: no value, a value, and a value that can't be computed."""

from __future__ import annotations

import numpy as np
import pytest
from pydrake.systems.framework import BasicVector, Context, DiagramBuilder, LeafSystem

from pdhocbf_drake.systems.optional_input import value_of


class Source(LeafSystem):
    """Computes a vector, or fails to."""

    def __init__(self, works: bool) -> None:
        super().__init__()
        self._works = works
        self.DeclareVectorOutputPort("out", 2, self._calc)

    def _calc(self, context: Context, output: BasicVector) -> None:
        if not self._works:
            raise RuntimeError("no answer")
        output.SetFromVector([1.0, 2.0])


class Reader(LeafSystem):
    """Has an input port."""

    def __init__(self) -> None:
        super().__init__()
        self.port = self.DeclareVectorInputPort("in", 2)


def test_an_unconnected_port_has_no_value() -> None:
    reader = Reader()
    context = reader.CreateDefaultContext()
    assert value_of(reader.port, context) is None
    reader.port.FixValue(context, np.array([3.0, 4.0]))
    np.testing.assert_array_equal(value_of(reader.port, context), [3.0, 4.0])


@pytest.mark.parametrize("works", [True, False])
def test_a_connected_port_has_its_value_or_the_failure_of_its_source(works: bool) -> None:
    builder = DiagramBuilder()
    source, reader = builder.AddSystem(Source(works)), builder.AddSystem(Reader())
    builder.Connect(source.get_output_port(), reader.get_input_port())
    diagram = builder.Build()
    context = reader.GetMyContextFromRoot(diagram.CreateDefaultContext())
    if works:
        np.testing.assert_array_equal(value_of(reader.port, context), [1.0, 2.0])
    else:
        with pytest.raises(RuntimeError, match="no answer"):
            value_of(reader.port, context)
