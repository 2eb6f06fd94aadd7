"""The controller of a walk for programs of one's own: stepped by hand, or as a block of another diagram."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike
from pydrake.systems.framework import System

from pdhocbf_drake.barriers import AffineBarrier, PeriodicAffineSystem
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.loop import Measurement, control
from pdhocbf_drake.mpc.memory import Memory
from pdhocbf_drake.mpc.plan import Plan
from pdhocbf_drake.simulation.build import build_walk
from pdhocbf_drake.simulation.checks import check_scenario
from pdhocbf_drake.simulation.limits import within_its_limits
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.systems.mpc_controller import MpcController
from pdhocbf_drake.systems.unbundled import unbundled
from pdhocbf_drake.walking.stance_system import stance_system


class WalkController:
    """The periodic MPC (36) with its memory from tick to tick; it needs measurements, and neither plant nor simulator.

    Attributes:
        mpc: the compiled problem, with `gait`, the template `vhip`, `divergent` component and `barriers` of x and y.
        memory: what is planned for the coming tick, and what the next step needs:
            com_reference: x, ẋ, ẍ, y, ẏ, ÿ [m, m/s, m/s²].
            zmp_reference: x_zmp and the ZMP velocity that leads to it, then those of y [m, m/s].
            zmp_box: x_min, x_max, y_min, y_max of the ZMP box (27) [m].
            foot_plan: where each foot starts and ends this step: x, y, x, y of the left, then of the right one [m].
            state: predicted c, v, p of x, then of y, shape (2, 3) [m, m/s, m].
        latency: from a measurement to the effect of what is planned from it [s].
    """

    def __init__(self, mpc: PeriodicMpc, start: Memory | None = None, latency: float = 0.0) -> None:
        """
        Args:
            start: the memory at tick 0; None stands at rest, CoM and ZMP in the middle between the feet.
        """
        self.mpc, self.latency = mpc, latency
        self.memory = Memory.standing(mpc) if start is None else start

    @classmethod
    def of(cls, scenario: Scenario) -> WalkController:
        """The controller of a scenario's walk, at rest at tick 0.

        Raises:
            InputError: the scenario is no walk, or its gait, controller or barriers can't be built.
        """
        check_scenario(scenario)
        if scenario.system == "van_der_pol":
            raise InputError(f"only a walk has this controller; {scenario.name} is the oscillator")
        return cls(build_walk(within_its_limits(scenario)).mpc)

    def step(
        self,
        tick: int,
        state: ArrayLike,
        feet: np.ndarray | None = None,
        zmp_offset: np.ndarray | None = None,
        bounds: Mapping[str, np.ndarray] | None = None,
        command: ArrayLike | None = None,
    ) -> Plan:
        """Plans at tick k from what is measured there; `memory` then belongs to tick k + 1.

        Args:
            tick: k.
            state: c, v, p of x, then of y, shape (2, 3) [m, m/s, m]; p is read only if `mpc.zmp_state` is "measured".
            feet: centres of the left and right sole, shape (2, 2) [m]; a foot that lands is put where it is measured.
                None leaves feet where they are planned.
            zmp_offset: expected real minus template ZMP at k + 1 … k + H per axis, shape (2, H) [m]; None is zero.
            bounds: V̄(k) … V̄(k + H) of each barrier by name, shape (H + 1,); None takes the barriers' own.
            command: of a walk that follows commands, in place of the scenario's: velocity ahead and to the left [m/s],
                turn rate [rad/s], and 1 for a stop or 0, shape (4,). It is taken up at the next touchdown, in the last
                eighth of a step, unless it stops, at the one after that, and limited to what the robot can do; where a
                number is not finite, the last command holds on.

        Returns:
            The plan: `inputs` are the ZMP velocities of the horizon, `footholds` the coming stance centres, and
            `reason` says why it may be less than an optimum. What is measured never raises.
        """
        given = None if command is None else np.asarray(command, dtype=float)
        measurement = Measurement(tick, np.asarray(state, dtype=float), feet, zmp_offset, bounds, given)
        self.memory, plan = control(self.mpc, self.memory, measurement, self.latency)
        return plan

    def template(
        self, axis: int, moves: ArrayLike | None = None
    ) -> tuple[PeriodicAffineSystem, Sequence[AffineBarrier]]:
        """The template of an axis of a straight walk from its stance foot, and its barriers.

        As `barriers.BarrierFilter` and `barriers.record` take them. The state is c, v, p, c and p from the stance foot
        [m, m/s, m], the input the ZMP velocity [m/s]; the bounds are those of the settled walk, and tick 0 begins an
        even step.

        Args:
            axis: 0 (x) or 1 (y).
            moves: from one foot to the next one, of an even and of an odd step, (2,); None for those commanded, from
                which the controller moves footholds by some millimetres across the heading [m].

        Raises:
            InputError: another axis or shape, or a walk that follows commands.
        """
        return stance_system(self.mpc.vhip, self.mpc.gait, axis, moves), self.mpc.barriers[axis]

    def system(self) -> System:
        """The controller as a Drake block that starts from `memory` at tick 0 and updates every tick.

        Its memory is discrete state of the context. It has the vector input port lip_state (c, v, p of x, then of y),
        and optional ones: foot_state, zmp_offset, gait_phase, barrier_bound, and where the scenario has commands,
        command (see `step`). Its output ports com_reference, zmp_reference, zmp_box, stance_plan, foot_plan,
        solver_status, barrier_slack, barrier_active, unmet, last_step and resumed are the signals of those names in
        docs/run_folder.md. It is a diagram around one `LeafSystem`, whose vector it takes apart.
        """
        names = [(axis, barrier.name) for axis, group in enumerate(self.mpc.barriers) for barrier in group]
        return unbundled(MpcController(self.mpc, self.memory.state, self.memory.feet, names, self.latency))
