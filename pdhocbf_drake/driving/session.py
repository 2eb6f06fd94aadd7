"""A driven walk: tick after tick in real time, under what its driver asks for, recorded as any other run."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorStatus

from pdhocbf_drake.config import parse_config
from pdhocbf_drake.driving.controls import GAMMAS, PUSH, Asked, Drive, Kept
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.simulation.drake_config import simulator_config
from pdhocbf_drake.simulation.log_rows import LogRows
from pdhocbf_drake.simulation.run_log import FAILED, FELL, FINISHED, RunLog
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.simulate import make_diagram
from pdhocbf_drake.systems.signals import places
from pdhocbf_drake.systems.unbundled import leaf_of
from pdhocbf_drake.terminal import say
from pdhocbf_drake.walking.barrier_changes import BarrierChange
from pdhocbf_drake.walking.commands import STOP, Command, read_late

LONGEST: Final = 3600.0
"""The longest drive [s]."""
_PUSHES = 16  # that can act at once
_ROWS = 500  # ticks of which the log is kept in memory
_FRAMES = 30  # a second
_DRIVEN = "A walk that was driven: its commands, pushes and changed barriers are those asked for while it walked."
(_YAW,) = places("path", "yaw")

Signals = dict[str, np.ndarray]


class Driven(NamedTuple):
    """What a drive leaves.

    Attributes:
        scenario: with what was asked for as its commands and pushes; `simulate` makes the same log of it.
        log: the recorded run.
        late_ticks: share of the ticks that ended later than they had to in real time; None where it was not to be kept.
    """

    scenario: Scenario
    log: RunLog
    late_ticks: float | None


def drivable(scenario: Scenario) -> Scenario:
    """The scenario with what a driver asks for to come in place of its own; raises `InputError`.

    What is to come stands in it as pushes and changes of barriers at its end, so that all is made before it begins.
    """
    if scenario.system == "van_der_pol":
        raise InputError("drive: walks can be driven, and the system of this scenario is van_der_pol")
    spare = {"time": LONGEST - 1.0, "duration": PUSH, "force": [0.0, 0.0, 0.0]}
    kept = [{"time": LONGEST - 1.0, "name": name, "gamma": gamma} for name in scenario.barriers for gamma in GAMMAS]
    changes: dict[str, Any] = {
        "commands": [{"time": 0.0, "stop": True}], "path": [], "pushes": [spare] * _PUSHES, "barrier_changes": kept,
    }  # fmt: skip
    return Scenario.from_dict(scenario.to_dict() | changes | {"duration": LONGEST}, "drive")


class Session:
    """A drive from its start to its end.

    Args:
        scenario: of a walk; its commands and pushes are left out.
        ask: what the driver asks for at a time [s].
        show: called some 30 times a second with the signals of the present tick and the share of late ticks so far;
            None shows nothing.
        pace: whether it keeps real time, or goes as fast as it can.
        rows: a new folder to which the log is written meanwhile.
    """

    def __init__(
        self,
        scenario: Scenario,
        ask: Callable[[float], Asked],
        show: Callable[[Signals, float], None] | None = None,
        pace: bool = True,
        rows: Path | None = None,
    ) -> None:
        self._scenario, self._ask, self._show, self._pace = drivable(scenario), ask, show, pace
        self._logged = make_diagram(self._scenario, form="fused")
        diagram = self._logged.diagram
        self._pushes = diagram.GetSubsystemByName("push_schedule")
        self._command = diagram.GetInputPort("command")
        self._settings = leaf_of(diagram.GetSubsystemByName("mpc_controller")).mpc.settings
        self._rows_folder, self._tick = rows, scenario.gait.tick
        self._begin()

    def _begin(self) -> None:
        """The start of a drive, in a context of its own."""
        columns = {name: place.stop - place.start for name, place in self._logged.columns.items()}
        self._written = None if self._rows_folder is None else LogRows(self._rows_folder, columns)
        self._simulator = Simulator(self._logged.diagram)
        ApplySimulatorConfig(simulator_config(self._scenario.simulator), self._simulator)
        self._context = self._simulator.get_mutable_context()
        for adjust in self._logged.adjust:
            adjust(self._context)
        self._drive, self._ticks, self._late, self._next_push = Drive(), 0, 0, 0
        if self._settings is not None:
            self._settings.clear()
        self._command_at(0.0, STOP)
        self._simulator.Initialize()

    def check(self, barriers: Iterable[tuple[str, float, Kept]]) -> None:
        """Tries changes of barriers that are to come, in the order of their times.

        Args:
            barriers: the name of each in messages, its time [s] and what it is.

        Raises:
            InputError: one of them can't be.
        """
        names = [*self._scenario.barriers]
        for where, start, kept in barriers:
            if self._settings is None or kept.name not in names:
                there = ", ".join(names) or "none"
                raise InputError(f"{where}.barrier: must be a barrier of the walk: {there} (given: {kept.name})")
            self._settings.add(parse_config(BarrierChange, {"time": start, **kept.given()}, where), where)
        if self._settings is not None:
            self._settings.clear()

    def run(
        self,
        seconds: float = LONGEST,
        stopped: Callable[[], bool] = lambda: False,
        progress: Callable[[float], None] = lambda now: None,
    ) -> Driven:
        """Drives until the driver ends it, `stopped` says so, the walk falls, or so much time has passed [s].

        Args:
            progress: called with the time of each tick [s].
        """
        last, ending = min(round(seconds / self._tick), round(LONGEST / self._tick) - 2), FINISHED
        due, shown, down = time.perf_counter(), -1.0, False
        progress(0.0)
        while self._ticks < last and not stopped():
            asked = self._ask(self._ticks * self._tick)
            if asked.ends:
                break
            if asked.restarts:
                self._begin()
                due, down, ending = time.perf_counter(), False, FINISHED
                continue
            if asked.paused or down:
                if down and not self._pace:
                    break
                time.sleep(self._tick)
                due = time.perf_counter()
                continue
            self._take(asked)
            reason = self._advance()
            progress(self._ticks * self._tick)
            if reason:
                ending, down = reason, True
            now = time.perf_counter()
            if self._show is not None and now - shown >= 1.0 / _FRAMES:
                self._show(self._logged.present(self._context), self._late / self._ticks)
                shown = now
            due += self._tick
            self._late += now > due + self._tick
            if self._pace:
                if now < due:
                    time.sleep(due - now)
                elif now > due + 0.2:  # it can't be made up for
                    due = now
        return self._driven(ending)

    def _take(self, asked: Asked) -> None:
        """Puts what is asked for into effect from the present tick on, and notes it."""
        now, command = round(self._ticks * self._tick, 9), asked.command
        # What is read at tick k is taken up in a step that begins at k + 1.
        period = self._scenario.gait.ticks_per_step
        phase = self._ticks % period
        read = self._ticks + (period - phase if command.walks and read_late(phase, period) else 0)
        self._command_at(round((read + 1) * self._tick, 9), command)
        for barrier in asked.barriers:
            self._keep(round(now + self._tick, 9), barrier)
        for push in asked.pushes:
            force = push.force(self._logged.present(self._context)["path"][_YAW])
            self._drive.push(now, force)
            last = self._ticks + max(1, round(PUSH / self._tick))
            context = self._pushes.GetMyMutableContextFromRoot(self._context)
            self._pushes.push(context, self._next_push, np.array(force), self._ticks, last)
            self._next_push = (self._next_push + 1) % _PUSHES

    def _keep(self, time: float, barrier: Kept) -> None:
        """Keeps a barrier in another way from the tick at a time on [s]; one that can't be is left as it is."""
        change = parse_config(BarrierChange, self._drive.keep(time, barrier), "drive")
        try:
            if self._settings is None:
                raise InputError(f"the walk has no barrier {barrier.name}")
            self._settings.add(change)
        except InputError as error:
            self._drive.barrier_changes.pop()
            say(f"pdhocbf: {error}")

    def _command_at(self, time: float, command: Command) -> None:
        """Gives the walk a command, which it reads before that time [s]."""
        if self._drive.command(time, command):
            value = [command.forward, command.lateral, command.turn, float(not command.walks)]
            self._command.FixValue(self._context, value)

    def _advance(self) -> str:
        """One tick; returns why the walk ended in it, or ""."""
        self._ticks += 1
        try:
            status = self._simulator.AdvanceTo(self._ticks * self._tick)
        except RuntimeError as error:
            return f"{FAILED}: {str(error).splitlines()[0].split('. ')[0]}"
        if self._written is not None:
            self._logged.hand_over(self._context, self._written, _ROWS)
        return FELL if status.reason() == SimulatorStatus.ReturnReason.kReachedTerminationCondition else ""

    def _driven(self, ending: str) -> Driven:
        if self._written is not None:
            self._logged.hand_over(self._context, self._written)
        log = self._logged.recorded(self._context, ending, self._written)
        drive = self._drive
        asked = {"commands": drive.commands, "pushes": drive.pushes, "barrier_changes": drive.barrier_changes}
        duration = {"duration": max(self._ticks, 1) * self._tick}
        given = asked | duration | {"description": _DRIVEN}
        scenario = Scenario.from_dict(self._scenario.to_dict() | given, "drive")
        return Driven(scenario, log, self._late / max(1, self._ticks) if self._pace else None)
