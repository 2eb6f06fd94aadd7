"""A Python block whose one output has a port for each of its parts."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from pdhocbf_drake.systems.unbundled import Unbundled


class _Doubled(LeafSystem):
    """Twice its input, and how often it was asked."""

    def __init__(self) -> None:
        super().__init__()
        self.calls = 0
        self._numbers = self.DeclareVectorInputPort("numbers", 5)
        self._other = self.DeclareVectorInputPort("other", 1)
        self.DeclareVectorOutputPort("all", 5, self._calc, {self._numbers.ticket()})

    def _calc(self, context: Context, output: BasicVector) -> None:
        self.calls += 1
        output.SetFromVector(2.0 * self._numbers.Eval(context))


def test_each_part_has_a_port_and_all_are_worked_out_in_one_call_however_time_goes_on() -> None:
    parts = {"first": 2, "nothing": 0, "second": 3}
    block = _Doubled()
    system = Unbundled(block, parts)
    context = system.CreateDefaultContext()
    for calls, numbers in enumerate((np.arange(5.0), np.ones(5)), start=1):
        system.GetInputPort("numbers").FixValue(context, numbers)
        for time in (0.0, 1.0):
            context.SetTime(calls + time)
            told = [system.GetOutputPort(name).Eval(context) for name in parts]
            assert [len(part) for part in told] == list(parts.values())
            np.testing.assert_array_equal(np.concatenate(told), 2.0 * numbers)
        assert block.calls == calls
    assert not system.GetInputPort("other").HasValue(context)
