"""Certificates: the invariant sets of one axis of a walk, without and with its bounds, and those of a scenario."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from pdhocbf_drake.barriers import AffineBarrier, Linear
from pdhocbf_drake.barriers.recursion import linear_rates
from pdhocbf_drake.mpc.config import Box, MpcConfig, RobustConfig
from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.orbit import nominal_walk
from pdhocbf_drake.mpc.robust import check_boxes, enforced_barrier
from pdhocbf_drake.robot import Biped
from pdhocbf_drake.sets.disturbance import Largest
from pdhocbf_drake.sets.invariant_set import InvariantSet, broken_phases
from pdhocbf_drake.sets.polytope import Polytope
from pdhocbf_drake.simulation.build import Walk, build_walk, even_climbs
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.sensed import sensed
from pdhocbf_drake.studies.certify.disturbed import Disturbance, Sets, largest, psi_set, walk_sets
from pdhocbf_drake.studies.shared.stepping_template import (
    SteppingTemplate,
    com_reach,
    is_input_limit,
    stepping_template,
)
from pdhocbf_drake.walking import Gait, GaitConfig
from pdhocbf_drake.walking.vhip import Vhip

"""Stages of `certify_scenario`: the walk, then the sets along x and y."""


_RATES = (0.2, 1.0)
"""Other γ that are tried beside a barrier's own, the same one for each of its class-K functions [1]."""
_COARSE = 2e-2  # of what they withstand, as a share of it


@dataclass(frozen=True)
class BoundCertificate:
    """The invariant sets of one barrier h on the template.

    Attributes:
        barrier: the barrier.
        kept: the states from which h ≥ 0 can be kept for ever. The bound is enforceable if there are any.
        rows: the same for ψ_m ≥ 0 with the barrier's own class-K functions, in a larger state; None if it was not
            computed or can't be (see `psi_system`; or gamma is so small that the sets are flat).
        enforced: the barrier whose ψ rows these are: the same one, or a nearer one under `mpc.robust`.
        failing: phases at which h ≥ 0 alone is *not* a barrier: from some state that has h ≥ 0 and could walk on for
            ever, every ZMP leads to h < 0 or to a fall at the next tick. There `kept` is smaller than the part of the
            unbounded set with h ≥ 0.
    """

    barrier: AffineBarrier
    kept: InvariantSet
    rows: InvariantSet | None
    failing: tuple[int, ...]
    enforced: AffineBarrier


class LargestDisturbance(NamedTuple):
    """The largest multiple of a disturbance for which some sets exist.

    Attributes:
        barriers: those under which, none for the walk without a bound.
        gamma: of the barrier's ψ rows, where these are to be kept; None where h ≥ 0 is.
        found: the multiple and its sets.
    """

    barriers: tuple[str, ...]
    gamma: tuple[float, ...] | None
    found: Largest


@dataclass(frozen=True)
class AxisCertificate:
    """The certified sets of one axis.

    Attributes:
        template: the dynamics and limits, input limits included.
        unbounded: the set without barriers, from which one can walk on for ever.
        kept: the set under all barriers of this axis together.
        bounds: each barrier by itself.
        input_limits: the barriers on the ZMP, which are limits of an input here and no barriers.
        left_out: those of them that no ZMP in its box keeps for every step that may have been chosen, so that they
            are not among the limits.
        disturbance: what the sets withstand, see `disturbed.walk_sets`; None for nothing.
        largest: for the set without barriers, that of each barrier, of its ψ rows, and of all barriers together.
    """

    template: SteppingTemplate
    unbounded: InvariantSet
    kept: InvariantSet
    bounds: tuple[BoundCertificate, ...]
    input_limits: tuple[AffineBarrier, ...] = ()
    left_out: tuple[AffineBarrier, ...] = ()
    disturbance: Disturbance | None = None
    largest: tuple[LargestDisturbance, ...] = ()

    def section(self, phase: int, sets: InvariantSet | None = None) -> Polytope | None:
        """The set in (c, v) at a phase, by default under all barriers; see `SteppingTemplate.section`."""
        return self.template.section(self.kept if sets is None else sets, phase)


@dataclass(frozen=True)
class ScenarioCertificate:
    """The certified sets of a scenario's walk.

    Attributes:
        scenario: the scenario, without a terminal set.
        walk: its gait, barriers and controller.
        reach: how far the CoM may be from the stance foot, along either axis [m].
        mass: of the robot or the template [kg]; an impulse is this times a change of velocity.
        orbit: c, v, p of the nominal walk without barriers, c and p from the stance foot, shape (2, 2N, 3).
        axes: the certificates along x and y.
    """

    scenario: Scenario
    walk: Walk
    reach: float
    mass: float
    orbit: np.ndarray
    axes: tuple[AxisCertificate, AxisCertificate]

    @property
    def main_axis(self) -> int:
        """The axis with the barriers; x where there are none."""
        return min(self.walk.axes, default=0)


def certify_axis(
    template: SteppingTemplate,
    barriers: Sequence[AffineBarrier],
    with_rows: bool = True,
    disturbance: Disturbance | None = None,
    search: bool = True,
    enforced: Callable[[AffineBarrier], AffineBarrier] = lambda barrier: barrier,
) -> AxisCertificate:
    """Computes the sets of one axis.

    Args:
        template: the dynamics and limits.
        barriers: those on this axis.
        with_rows: also certify each barrier's ψ rows, which takes a set of one more dimension.
        disturbance: what the sets are to withstand.
        search: look for the largest multiple of it, which takes some fifteen times as long as the sets.
        enforced: gives the barrier whose ψ rows the controller has, for each one.

    Raises:
        InputError: a barrier that can't be certified here, or sets that don't converge.
    """
    counted: list[AffineBarrier] = []
    left_out: list[AffineBarrier] = []
    for limit in filter(is_input_limit, barriers):
        limited = template.with_input_limit(limit)
        template = limited or template
        (counted if limited else left_out).append(limit)
    barriers = [barrier for barrier in barriers if not is_input_limit(barrier)]
    unbounded = walk_sets(template, (), disturbance)
    bounds = tuple(
        BoundCertificate(
            barrier,
            walk_sets(template, [barrier], disturbance),
            psi_set(template, barrier, enforced(barrier), disturbance) if with_rows else None,
            _failing(template, unbounded, barrier, disturbance),
            enforced(barrier),
        )
        for barrier in barriers
    )
    if len(barriers) < 2:
        kept = bounds[0].kept if bounds else unbounded
    else:
        kept = walk_sets(template, barriers, disturbance)
    found = AxisCertificate(template, unbounded, kept, bounds, tuple(counted), tuple(left_out), disturbance)
    return (
        found
        if disturbance is None or not search
        else replace(found, largest=tuple(_largest(found, disturbance, with_rows, enforced)))
    )


def _largest(
    found: AxisCertificate,
    disturbance: Disturbance,
    with_rows: bool,
    enforced: Callable[[AffineBarrier], AffineBarrier],
) -> Iterator[LargestDisturbance]:
    """What `AxisCertificate.largest` lists."""
    template = found.template
    free = largest(disturbance, found.unbounded, lambda given, within: walk_sets(template, (), given, within))
    yield LargestDisturbance((), None, free)
    for bound in found.bounds:
        barrier, name = bound.barrier, (bound.barrier.name,)

        def kept(given: Disturbance, within: Sets, barrier: AffineBarrier = barrier) -> InvariantSet:
            return walk_sets(template, [barrier], given, within)

        def rows(given: Disturbance, within: Sets, bound: BoundCertificate = bound) -> InvariantSet | None:
            return psi_set(template, bound.barrier, bound.enforced, given, within)

        yield LargestDisturbance(name, None, largest(disturbance, bound.kept, kept))
        if with_rows and (undisturbed := psi_set(template, barrier, bound.enforced)) is not None:
            found_rows = largest(disturbance, bound.rows, rows, undisturbed)
            yield LargestDisturbance(name, linear_rates(barrier), found_rows)
            for rate in _RATES:
                other = barrier.with_class_k([Linear(rate)] * barrier.order)

                def with_rate(
                    given: Disturbance, within: Sets, barrier: AffineBarrier = barrier, other: AffineBarrier = other
                ) -> InvariantSet | None:
                    return psi_set(template, barrier, enforced(other), given, within)

                calm = with_rate(disturbance.times(0.0), ())
                if calm is not None and linear_rates(other) != linear_rates(barrier):
                    coarse = largest(disturbance, None, with_rate, calm, _COARSE)
                    yield LargestDisturbance(name, linear_rates(other), coarse)
    if len(found.bounds) > 1:
        together = [bound.barrier for bound in found.bounds]
        names = tuple(barrier.name for barrier in together)
        scale = largest(disturbance, found.kept, lambda given, within: walk_sets(template, together, given, within))
        yield LargestDisturbance(names, None, scale)


def _failing(
    template: SteppingTemplate, unbounded: InvariantSet, barrier: AffineBarrier, disturbance: Disturbance | None
) -> tuple[int, ...]:
    """Phases at which the set {h ≥ 0} within the unbounded one does not lead into itself."""
    if not unbounded.enforceable:
        return tuple(range(template.period))
    states = template.with_barriers([barrier], unbounded.sets)
    if disturbance is None:
        return broken_phases(template.system, states, template.inputs)
    left = disturbance.left(template, states)
    return broken_phases(template.system, left, template.inputs, disturbance.of_prediction(template))


def certify_scenario(
    scenario: Scenario,
    reach: float | None = None,
    with_rows: bool = True,
    report: Callable[[int, str], None] = lambda done, stage: None,
    disturbance: Box | RobustConfig | None = None,
    search: bool = True,
) -> ScenarioCertificate:
    """Certifies both axes of a scenario's walk.

    Args:
        scenario: a walk, on the robot or on the template.
        reach: of the CoM from the stance foot [m]; by default half the longest stride of the robot.
        with_rows: certify the ψ rows as well.
        report: called with the number of stages that are done, of three, and the name of the next one.
        disturbance: half-widths of what a tick may add to the CoM and to its velocity, along x and y [m, m/s], or all
            that a `RobustConfig` says of that.
        search: as in `certify_axis`.

    Raises:
        InputError: the scenario can't be built or certified. ModelError: nor its robot.
    """
    if scenario.mpc.terminal_set is not None:  # certifying makes a new one
        mpc = scenario.mpc.model_copy(update={"terminal_set": None})
        scenario = scenario.model_copy(update={"mpc": mpc})
    report(0, "walk and nominal orbit")
    walk = build_walk(scenario)
    mass = scenario.vhip.mass
    if scenario.system == "biped":
        mass = Biped.load(scenario.robot).mass
    reach = com_reach(scenario) if reach is None else reach
    gait, mpc, rise = _even_ground(scenario, walk)
    axes, given = [], _disturbances(disturbance, scenario)
    for axis in (0, 1):
        template = stepping_template(gait, mpc, axis, reach, rise)
        report(1 + axis, f"sets along {'xy'[axis]}")
        axes.append(
            certify_axis(
                template, walk.mpc.barriers[axis], with_rows, given[axis], search,
                partial(enforced_barrier, vhip=walk.vhip, config=mpc, axis=axis),
            )
        )  # fmt: skip
    return ScenarioCertificate(scenario, walk, reach, mass, _free_orbit(gait, mpc, rise), (axes[0], axes[1]))


def _disturbances(given: Box | RobustConfig | None, scenario: Scenario) -> Sequence[Disturbance | None]:
    """Those along x and y; none along either axis where no tick adds anything."""
    if given is None:
        return None, None
    robust = given if isinstance(given, RobustConfig) else RobustConfig(disturbance=given)
    missed, delay = robust.errors if robust.innovations else (0.0, 0.0), sensed(scenario).delay_ticks
    pair = [Disturbance(robust.boxes(axis), delay, missed) for axis in (0, 1)]
    if not any(np.any(part.boxes) for part in pair):
        return None, None
    for axis, part in enumerate(pair):
        check_boxes(part.boxes, scenario.gait.ticks_per_step, f"the disturbance along {'xy'[axis]}")
    return pair


def _even_ground(scenario: Scenario, walk: Walk) -> tuple[GaitConfig, MpcConfig, float]:
    """The walk that is certified, and the rise of its steps: on known stairs the steepest ones, else level ground.

    On stairs the feet stand in the middle of the treads, so that the sets hold wherever else on them a foot may land.
    """
    climbs = even_climbs(walk.gait)
    if not climbs:
        return scenario.gait, sensed(scenario), 0.0
    stride, rise = max(climbs, key=lambda climb: abs(climb[1]))
    tolerance = (0.0, scenario.mpc.step_tolerance[1])
    gait = scenario.gait.model_copy(update={"stride": stride})
    return gait, sensed(scenario).model_copy(update={"step_tolerance": tolerance}), rise


def _free_orbit(config: GaitConfig, mpc: MpcConfig, rise: float) -> np.ndarray:
    """c, v, p of the nominal walk without barriers and without an end, shape (2, 2N, 3); see `nominal_walk`."""
    gait = Gait(config.model_copy(update={"walk_steps": None}))
    return nominal_walk(gait, PeriodicMpc(gait, Vhip(gait.eta(rise), config.tick), mpc, ([], [])))
