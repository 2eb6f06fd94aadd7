"""A Python block with one output vector, and a diagram with a port for each part of it."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiagramBuilder, LeafSystem

from pdhocbf_drake.systems.unbundled import leaf_of, unbundled


class _Doubled(LeafSystem):
    """Twice its input, with a count of its calls."""

    def __init__(self, **parts: int) -> None:
        super().__init__()
        self.parts = parts
        self.calls = 0
        self._numbers = self.DeclareVectorInputPort("numbers", 5)
        self._other = self.DeclareVectorInputPort("other", 1)
        self.DeclareVectorOutputPort("all", 5, self._calc, {self._numbers.ticket()})

    def _calc(self, context: Context, output: BasicVector) -> None:
        self.calls += 1
        output.SetFromVector(2.0 * self._numbers.Eval(context))


def test_each_part_has_a_port_and_all_are_worked_out_in_one_call() -> None:
    block = _Doubled(first=2, nothing=0, second=2)  # the last number stays inside
    system = unbundled(block)
    context = system.CreateDefaultContext()
    for calls, numbers in enumerate((np.arange(5.0), np.ones(5)), start=1):
        system.GetInputPort("numbers").FixValue(context, numbers)
        values = [system.GetOutputPort(name).Eval(context) for name in ("first", "nothing", "second")]
        assert [len(part) for part in values] == [2, 0, 2]
        np.testing.assert_array_equal(np.concatenate(values), 2.0 * numbers[:4])
        assert block.calls == calls
    assert not system.GetInputPort("other").HasValue(context)


def test_what_stands_behind_is_not_worked_out_anew_because_time_goes_on() -> None:
    builder, block, behind = DiagramBuilder(), _Doubled(all=5), _Doubled()
    system = builder.AddSystem(unbundled(block))
    builder.AddSystem(behind)
    builder.Connect(system.GetOutputPort("all"), behind.GetInputPort("numbers"))
    builder.ExportInput(system.GetInputPort("numbers"), "numbers")
    builder.ExportOutput(behind.get_output_port(), "all")
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    diagram.GetInputPort("numbers").FixValue(context, np.ones(5))
    for time in (0.0, 1.0, 2.0):
        context.SetTime(time)
        np.testing.assert_array_equal(diagram.GetOutputPort("all").Eval(context), 4.0 * np.ones(5))
    assert behind.calls == 1


def test_the_block_inside_is_the_one_given_with_its_attributes() -> None:
    builder, block = DiagramBuilder(), _Doubled(all=5)
    builder.AddNamedSystem("doubled", unbundled(block))
    diagram = builder.Build()
    del builder
    assert leaf_of(diagram.GetSubsystemByName("doubled")) is block
