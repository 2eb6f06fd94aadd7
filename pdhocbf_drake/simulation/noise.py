"""White noise that the log and the controller read alike, made of Drake's own blocks."""

from __future__ import annotations

from pydrake.common import RandomDistribution, RandomGenerator
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, OutputPort
from pydrake.systems.primitives import RandomSource, ZeroOrderHold

from pdhocbf_drake.simulation.wiring import Wiring


def add_noise(wiring: Wiring, name: str, count: int, time: float, seed: int) -> OutputPort:
    """Standard normal numbers (count,), drawn anew after a time [s].

    A `RandomSource` draws between the log's publish event and the controller's update of the same instant. Behind a
    `ZeroOrderHold`, which hands on each draw one `time` later, both read the same numbers, and what is computed from
    them is computed once.
    """
    source = wiring.builder.AddNamedSystem(f"{name}_source", RandomSource(RandomDistribution.kGaussian, count, time))
    hold = wiring.builder.AddNamedSystem(name, ZeroOrderHold(time, count))
    wiring.builder.Connect(source.get_output_port(), hold.get_input_port())

    def start(root: Context) -> None:
        drawing = Simulator(RandomSource(RandomDistribution.kGaussian, count, time))
        alone = drawing.get_mutable_context()
        drawing.get_system().SetRandomContext(alone, RandomGenerator(seed))
        drawing.AdvanceTo(0.5 * time)  # past the draw at 0, which the hold begins with
        source.GetMyMutableContextFromRoot(root).SetStateAndParametersFrom(alone)
        first = drawing.get_system().get_output_port().Eval(alone)
        hold.SetVectorState(hold.GetMyMutableContextFromRoot(root), first)

    wiring.adjust.append(start)
    return hold.get_output_port()
