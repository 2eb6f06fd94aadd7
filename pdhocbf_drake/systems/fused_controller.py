"""The controller's blocks as one: their functions, called in turn in one update a tick."""

from __future__ import annotations

import time
from typing import NamedTuple

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues

from pdhocbf_drake.mpc.axis_problem import layout
from pdhocbf_drake.mpc.kernels import same_bits
from pdhocbf_drake.mpc.loop import Measurement
from pdhocbf_drake.mpc.memory import Memory
from pdhocbf_drake.mpc.memory_layout import joined
from pdhocbf_drake.systems.barrier_schedule import BarrierSchedule
from pdhocbf_drake.systems.block import Block, weakly
from pdhocbf_drake.systems.foot_reference import FootReference
from pdhocbf_drake.systems.footing import Footing
from pdhocbf_drake.systems.gait_reference import GaitReference
from pdhocbf_drake.systems.ground_reference import GroundReference
from pdhocbf_drake.systems.inverse_kinematics import InverseKinematics
from pdhocbf_drake.systems.mpc_controller import MpcController
from pdhocbf_drake.systems.optional_input import OptionalInput
from pdhocbf_drake.systems.path_reference import PathReference
from pdhocbf_drake.systems.signals import size
from pdhocbf_drake.systems.torque_bias import TorqueBias
from pdhocbf_drake.systems.turn_reference import TurnReference
from pdhocbf_drake.systems.zmp_offset import ZmpOffset
from pdhocbf_drake.walking import Gait


class ControllerBlocks(NamedTuple):
    """Clock and MPC, `schedule` of a walk with barriers, and `path` of one that turns."""

    clock: GaitReference
    controller: MpcController
    schedule: BarrierSchedule | None
    path: PathReference | None


class BodyBlocks(NamedTuple):
    """The blocks that a robot has and the template has not; `turn` of a walk that turns, `ground` of an uneven one.

    `footing` is that of feet that feel the ground, `bias` that of legs that learn what torque the model lacks.
    """

    feet: FootReference
    kinematics: InverseKinematics
    offset: ZmpOffset
    turn: TurnReference | None
    ground: GroundReference | None = None
    footing: Footing | None = None
    bias: TorqueBias | None = None


class _Known(NamedTuple):
    """A state of the block for tick k, the gait as it has been changed then, and the MPC's memory in it."""

    state: np.ndarray
    tick: int
    gait: Gait
    memory: Memory


class FusedController(Block):
    """All blocks between a measurement and the joint targets, with their ports, in one discrete update at kδ.

    Where the blocks compute an output when it is read, after the update at kδ, this block computes all of them in that
    update. Its one discrete state has the values of its output ports for tick k + 1, and behind them what the blocks
    remember. Drake then calls Python twice a tick, and not twenty times.

    Input ports:
        lip_state (6), foot_state (12), command (4): as of `MpcController`; foot_state is needed on a robot.
        actuation (12): as of `InverseKinematics`, where that has a whole-body layer, and of `TorqueBias`.
        foot_load (2): as of `Footing`, where there is one.
        true_state (6): lip_state without measurement errors, from which h is computed; where there are barriers.
    Output parts, see `unbundled`:
        gait_phase, com_height, path, command_asked, barrier_bound, foot_reference, turn_reference, ground_reference,
        foot_target, ground_target, zmp_offset, desired_state, feedforward, whole_body_zmp, ik_status, torque_bias,
        sent_torque, and those of `MpcController`, as far as the walk has them.
    Output ports:
        h (n_b): where there are barriers.

    Args:
        blocks: whose functions it calls. body: likewise, of a robot.
    """

    def __init__(self, blocks: ControllerBlocks, body: BodyBlocks | None = None) -> None:
        super().__init__()
        clock, controller, schedule, path = blocks
        self._clock, self._controller, self._schedule, self._path = blocks
        self._body, self.mpc = body, controller.mpc
        gait = self.mpc.gait
        self._n, self._count = gait.period, 0 if schedule is None else schedule.parts["h"]
        self.parts = {**clock.parts, **(path.parts if path else {})}
        if schedule is not None:
            self.parts["barrier_bound"] = schedule.parts["barrier_bound"]
        if body is not None:
            self.parts |= {"foot_reference": size("foot_reference")}
            self.parts |= {"turn_reference": size("turn_reference")} if body.turn else {}
            self.parts |= {"ground_reference": size("ground_reference")} if body.ground else {}
            self.parts |= body.footing.parts if body.footing else {}
            self.parts |= {"zmp_offset": size("zmp_offset", horizon=self.mpc.config.horizon)}
            self.parts |= body.kinematics.parts
            self.parts |= body.bias.parts if body.bias else {}
        self.parts |= controller.parts
        sizes, kept = controller.layout.sizes, {} if body is None else {"motion": body.kinematics.start}
        kept |= {} if body is None else {"table": np.zeros(2 * gait.period * body.offset.tables)}
        footing, bias = (None, None) if body is None else (body.footing, body.bias)
        kept |= {} if footing is None else {"footing": footing.start}
        kept |= {} if bias is None else {"bias": bias.start}
        behind = {name: count for name, count in sizes.items() if name not in controller.parts}
        self._places = layout({**self.parts, **behind, **{name: len(start) for name, start in kept.items()}})
        if body is not None:
            places = [self._places[name] for name in body.kinematics.parts]
            self._kinematics = slice(places[0].start, places[-1].stop)
        self._plan = slice(self._places[next(iter(sizes))].start, self._places[next(reversed(sizes))].stop)
        before = {name: np.zeros(size(name)) for name in ("foot_reference", "turn_reference")} | kept
        self._last = self._following(0, controller.start[1], before)
        self._lip = self.DeclareVectorInputPort("lip_state", size("lip_state"))
        feet = self.DeclareVectorInputPort("foot_state", size("foot_state")) if body else None
        self._loads = self.DeclareVectorInputPort("foot_load", size("foot_load")) if footing else None
        command = self.DeclareVectorInputPort("command", 4) if gait.turns else None
        self._feet, self._command = (None if port is None else OptionalInput(port) for port in (feet, command))
        self.DeclareStateOutputPort("outputs", self.DeclareDiscreteState(self._last.state))
        self.DeclarePeriodicDiscreteUpdateEvent(gait.config.tick, 0.0, self._update)
        learns = body is not None and (body.kinematics.layer is not None or bias is not None)
        self._applied = self.DeclareVectorInputPort("actuation", size("actuation")) if learns else None
        if schedule is not None:
            self._true = self.DeclareVectorInputPort("true_state", size("lip_state"))
            self.DeclareVectorOutputPort("h", self._count, weakly(self._h), {self._true.ticket(), self.xd_ticket()})

    @property
    def latency(self) -> float:
        """From a measurement to the effect of what is planned from it, see `MpcController` [s]."""
        return self._controller.latency

    def memory(self, context: Context) -> Memory:
        """What the MPC remembers before its update, in a context of this block."""
        return self._known(context.get_discrete_state_vector().value()).memory

    def measurement(self, context: Context) -> Measurement:
        """What the MPC is given at the tick of a context of this block."""
        return self._measurement(context, self._known(context.get_discrete_state_vector().value()))

    def _known(self, state: np.ndarray) -> _Known:
        """What a state holds: in a run that of the last update, which need not be taken apart."""
        if same_bits(state, self._last.state):
            return self._last
        own = np.array(state)
        phase, step, _ = own[self._places["gait_phase"]].tolist()
        memory = self._controller.layout.unpack(own[self._plan])
        return _Known(own, round(step * self._n + phase), memory.problem(self.mpc).gait, memory)

    def _measurement(self, context: Context, known: _Known) -> Measurement:
        state, part = known.state, self._places
        feet = None if self._feet is None else self._feet(context)
        command = None if self._command is None else self._command(context)
        offset = None if self._body is None else state[part["zmp_offset"]]
        bounds = None if self._schedule is None else state[part["barrier_bound"]]
        late = state[part["landing_delay"]] if "landing_delay" in part else None
        return self._controller.measured(known.tick, self._lip.Eval(context), feet, offset, bounds, command, late)

    def _update(self, context: Context, values: DiscreteValues) -> None:
        started = time.perf_counter()
        known = self._known(context.get_discrete_state_vector().value())
        state, part = known.state, self._places
        memory = self._controller.planned(known.memory, self._measurement(context, known), started)
        before = {}
        if self._body is not None:
            names = ("gait_phase", "whole_body_zmp", "zmp_reference", "foot_reference", "table", "motion")
            phase, zmp, planned, feet, table, motion = [state[part[name]] for name in names]
            table = self._body.offset.learned(phase, zmp, planned, feet, table, known.gait)
            before = {"foot_reference": feet, "table": table, "motion": motion}
            if self._applied is not None:
                applied, parts = self._applied.Eval(context), state[self._kinematics]
                status = state[part["solver_status"]]
                before["motion"] = self._body.kinematics.learned(motion, phase, parts, applied, status)
                if self._body.bias is not None:
                    feedforward = state[part["feedforward"]]
                    before["bias"] = self._body.bias.learned(state[part["bias"]], phase, status, feedforward, applied)
            if self._body.turn is not None:
                before["turn_reference"] = state[part["turn_reference"]]
            if self._body.footing is not None:
                before["footing"] = self._felt(context, self._body.footing, known, phase, feet)
        self._last = self._following(known.tick + 1, memory, before)
        values.set_value(self._last.state)

    def _felt(
        self, context: Context, footing: Footing, known: _Known, phase: np.ndarray, feet: np.ndarray
    ) -> np.ndarray:
        """What `footing` remembers for the next tick."""
        assert self._feet is not None and self._loads is not None
        state, part, measured = known.state, self._places, self._feet(context)
        ground = state[part["ground_reference"]] if "ground_reference" in part else None
        measured = np.full(size("foot_state"), np.nan) if measured is None else measured
        return footing.felt(
            state[part["footing"]], phase, feet, ground, known.gait, measured, self._loads.Eval(context)
        )

    def _following(self, tick: int, memory: Memory, before: dict[str, np.ndarray]) -> _Known:
        """The block's state for tick k, from the MPC's memory and what the other blocks remember."""
        gait = memory.problem(self.mpc).gait
        commanded, step = self._clock.commanded(tick, gait), tick // self._n
        front, behind = [commanded], []
        if self._path is not None:
            front.append(np.array(self._path.commanded(step, gait)))
        if self._schedule is not None:
            front += self._schedule.bounds(tick, gait)
        if self._body is not None:
            body, phase, height = self._body, commanded[:3], commanded[3:]
            com, zmp, foot_plan, stances = (
                memory.com_reference, memory.zmp_reference, memory.foot_plan, memory.stance_plan,
            )  # fmt: skip
            feet = body.feet.reference(phase, foot_plan, before["foot_reference"], gait)
            turn = None
            if body.turn is not None:
                turn = body.turn.headings(tick % self._n, step, before["turn_reference"], gait)
            ground = None if body.ground is None else body.ground.reference(phase, com, zmp, gait)
            offset = body.offset.expected(phase, feet, foot_plan, stances, before["table"], gait)
            own, felt = [part for part in (turn, ground) if part is not None], []
            soles = feet
            if body.footing is not None:
                felt = [before["footing"]]
                soles, ground, late = body.footing.targets(before["footing"], phase, feet, ground, gait)
                own += [soles, ground, late]
            solution = body.kinematics.solution(before["motion"], phase, height, com, zmp, soles, turn, ground)
            coming = body.kinematics.coming
            front += [feet, *own, offset, solution[: coming.start]]
            behind = [solution[coming], before["table"], *felt]
            if body.bias is not None:
                front.append(body.bias.torques(before["bias"], solution[body.kinematics.feedforward]))
                behind.append(before["bias"])
        parts = self._controller.layout.parts(memory)
        return _Known(joined([*front, *parts, *behind]), tick, gait, memory)

    def _h(self, context: Context, output: BasicVector) -> None:
        assert self._schedule is not None
        known, part = self._known(context.get_discrete_state_vector().value()), self._places
        state, h = known.state, np.empty(self._count)
        path = None if self._path is None else state[part["path"]]
        bounds, stances = state[part["barrier_bound"]], state[part["stance_plan"]]
        self._schedule.write_h(known.tick, known.gait, self._true.Eval(context), stances, path, bounds, h)
        output.SetFromVector(h)
