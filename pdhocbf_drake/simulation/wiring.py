"""A diagram under construction, whose ports are connected and logged by name; and the finished diagram with its log."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, OutputPort, System
from pydrake.systems.primitives import LogVectorOutput, Multiplexer, VectorLogSink

from pdhocbf_drake.simulation.log_rows import Array, LogRows
from pdhocbf_drake.simulation.run_log import FINISHED, RunLog

_MEASURED, _SIGNALS = "_measured", "signals"

Form = Literal["blocks", "fused"]
"""Whether a diagram has a block for each part of the controller, or one for all of them, with the same ports and log.

The one block, a `FusedController`, calls the functions of the others in turn, which takes less time.
"""


@dataclass
class LoggedDiagram:
    """A diagram whose logged signals (`systems.signals`) all go into one sink.

    Attributes:
        sink: takes one sample a tick. Every sink costs 1 µs at each step of the plant, so there is one.
        columns: each signal's place in a sample.
        adjust: functions to apply to each new context of the diagram, which set seeds and parameters.
    """

    diagram: Diagram
    sink: VectorLogSink
    columns: dict[str, slice]
    adjust: list[Callable[[Context], None]] = field(default_factory=list)

    def recorded(self, context: Context, ending: str = FINISHED, rows: LogRows | None = None) -> RunLog:
        """A copy of the log in a context of the diagram, after the rows that were handed over."""
        tables, time = self._samples(context)
        if rows is None:
            return RunLog(tables, time, ending)
        before, then = rows.read()
        if not len(time):
            return RunLog(before, then, ending)
        joined = {name: np.concatenate([before[name], table]) for name, table in tables.items()}
        return RunLog(joined, np.concatenate([then, time]), ending)

    def hand_over(self, context: Context, rows: LogRows, at_least: int = 0) -> None:
        """Moves the log in a context to disk, once it has so many rows; they stay where that can't be done."""
        if self.sink.FindLog(context).num_samples() >= at_least and rows.append(*self._samples(context)):
            self.forget(context)

    def present(self, context: Context) -> dict[str, Array]:
        """Each logged signal as it is in a context, (size,)."""
        signals = self.diagram.GetSubsystemByName(_SIGNALS)
        values = signals.get_output_port().Eval(signals.GetMyContextFromRoot(context))
        return {name: values[place] for name, place in self.columns.items()}

    def forget(self, context: Context) -> None:
        """Empties the log of a context."""
        self.sink.FindMutableLog(context).Clear()

    def _samples(self, context: Context) -> tuple[dict[str, Array], Array]:
        """The table of each signal and the time of its rows [s].

        A simulator that goes on from a context at a tick logs that tick once more; the later row, which the run
        continues from, is kept.
        """
        log = self.sink.FindLog(context)
        times = log.sample_times()
        kept = np.flatnonzero(np.diff(times, append=np.inf))
        samples = log.data().T[kept]
        return {name: np.ascontiguousarray(samples[:, place]) for name, place in self.columns.items()}, times[kept]


@dataclass
class Wiring:
    """A diagram under construction.

    An output port is registered under its own name when its block is added, or by `offer`; input ports are connected
    to the output port of the same name. A port that is measured with an error has a second, measured one of its name,
    to which the controller is connected.

    Attributes:
        tick: interval of the log [s].
        adjust: as in `LoggedDiagram`.
    """

    tick: float
    builder: DiagramBuilder = field(default_factory=DiagramBuilder)
    adjust: list[Callable[[Context], None]] = field(default_factory=list)
    _ports: dict[str, OutputPort] = field(default_factory=dict)
    _logged: list[str] = field(default_factory=list)

    def add(self, name: str, system: System) -> System:
        """Adds a block, and registers those of its output ports whose names are new."""
        self.builder.AddNamedSystem(name, system)
        for i in range(system.num_output_ports()):
            port = system.get_output_port(i)
            self._ports.setdefault(port.get_name(), port)
        return system

    def offer(self, name: str, port: OutputPort, measured: bool = False) -> None:
        """Registers an output port under a name, or the late or noisy copy of the port of that name."""
        self._ports[name + _MEASURED * measured] = port

    def port(self, name: str, measured: bool = False) -> OutputPort:
        """The output port of that name, or its measured copy if it has one."""
        return self._ports.get(name + _MEASURED * measured, self._ports[name])

    def true_state(self, from_stance: bool) -> OutputPort:
        """What barriers are judged on: lip_state, for those seen `from_stance` as the plan counts it."""
        lip = self._ports["lip_state"]
        return self._ports.get("true_state", lip) if from_stance else lip

    def connect(self, system: System, *names: str, measured: bool = False) -> None:
        """Connects input ports to the output ports of the same names, or to their measured copies."""
        for name in names:
            self.builder.Connect(self.port(name, measured), system.GetInputPort(name))

    def log(self, *names: str) -> None:
        """Logs output ports at every tick."""
        self._logged += names

    def build(self, name: str) -> LoggedDiagram:
        """The diagram, with one sink for all logged ports."""
        ports = [self._ports[signal] for signal in self._logged]
        signals = self.builder.AddNamedSystem(_SIGNALS, Multiplexer([port.size() for port in ports]))
        for i, port in enumerate(ports):
            self.builder.Connect(port, signals.get_input_port(i))
        sink = LogVectorOutput(signals.get_output_port(), self.builder, self.tick)
        sink.set_name("log")
        ends = np.cumsum([port.size() for port in ports]).tolist()
        columns = {s: slice(end - port.size(), end) for s, port, end in zip(self._logged, ports, ends, strict=True)}
        diagram = self.builder.Build()
        diagram.set_name(name)
        return LoggedDiagram(diagram, sink, columns, self.adjust)
