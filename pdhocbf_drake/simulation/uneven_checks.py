"""Whether a walk over the ground of its map can be walked, by name: legs, edges, time of a step, the largest rise."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

from pdhocbf_drake.errors import InputError, ModelError, PdhocbfError
from pdhocbf_drake.fitting.findings import Finding
from pdhocbf_drake.fitting.uneven_effort import uneven_effort
from pdhocbf_drake.fitting.uneven_walk import HURRIED, LEAST_CLEARANCE, uneven_steps
from pdhocbf_drake.fitting.walk_checks import effort_findings
from pdhocbf_drake.ground.config import Piece, Stairs
from pdhocbf_drake.robot import Biped
from pdhocbf_drake.simulation.commands import commanded_gait, goes_ahead
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.walking import Gait
from pdhocbf_drake.walking.sides import BOTH, LEFT

_HALVINGS = 6  # of the rise
_HEIGHTS = 1.0, 0.96, 0.93, 0.9, 0.86  # of the CoM, over the robot's own
_HIGHEST = 0.5  # rise that is tried, likewise
_LEVEL = 1e-6  # [m]: by which a sole's corners may be off its plane
_EDGED = "stairs", "blocks", "boards", "rough"  # kinds whose edges feet have to keep off


def check_known_ground(scenario: Scenario, biped: Biped) -> None:
    """Refuses a walk over known ground whose steps are out of reach or can't be swung.

    Raises:
        InputError: it follows commands over edges, or a surface is shorter or narrower than the soles.
        ModelError: a step is out of the legs' reach, or its swing foot can't keep off the edges.
    """
    known = [(i, piece) for i, piece in enumerate(scenario.ground) if piece.known]
    if not known:
        return
    for index, piece in known:
        if piece.kind in _EDGED and not goes_ahead(scenario):
            raise InputError(
                f"ground.{index}: {piece.kind} on the map can be walked straight ahead from x = 0 alone, without "
                "commands, path or start; with known: false it is ground that nobody expects"
            )
    gait = commanded_gait(scenario)
    _check_sides(scenario, biped, gait)
    for step in uneven_steps(biped, gait, reserve=0.0):
        if step.missed:
            why = _rise(scenario, biped, step.place) or step.missed
            raise ModelError(f"{_named(scenario, step.place)} is beyond the legs' reach: {why}")
        if step.clearance < LEAST_CLEARANCE:
            raise ModelError(
                f"{_named(scenario, step.place)} brings the swing foot to {1e3 * step.clearance:.0f} mm from an edge, "
                f"where {1e3 * LEAST_CLEARANCE:g} mm are needed: longer treads, or a lower rise"
            )


def known_ground_findings(scenario: Scenario, biped: Biped) -> Iterator[Finding]:
    """What `check_known_ground` says, and where it refuses nothing, how the walk takes its steps."""
    if not any(piece.known for piece in scenario.ground):
        return
    key = "ground, gait.com_height, gait.ticks_per_step"
    try:
        check_known_ground(scenario, biped)
        walk = commanded_gait(scenario)
        steps = list(uneven_steps(biped, walk))
    except PdhocbfError as error:
        yield Finding("ground", "fault", key, str(error), "lower rises, longer treads, or another gait.com_height")
        return
    gait, hurried = scenario.gait, max(step.acceleration for step in steps)
    least = min(step.clearance for step in steps)
    edges = f"; the swing foot stays {1e3 * least:.0f} mm from edges and takes {hurried:.2g} g" if least < 1.0 else ""
    said = f"steps of {gait.ticks_per_step * gait.tick:g} s with the CoM at {gait.com_height:g} m{edges}"
    yield Finding("ground", "ok", key, said)
    if hurried > HURRIED:
        fix = "longer steps (gait.ticks_per_step, with mpc.horizon)"
        yield Finding("ground", "note", key, f"the swing foot takes {hurried:.2g} g, more than {HURRIED:g} g", fix)
    for step in steps:
        if step.missed:
            said = f"{_named(scenario, step.place)} stretches the legs: {step.missed} with the CoM 2 cm higher"
            yield Finding("ground", "note", key, said, "a lower gait.com_height")
            break
    effort = uneven_effort(biped, walk, (step.number for step in steps))
    yield from effort_findings(biped, *effort, "on this ground", ("ground torque", "ground speed"))
    for index, piece in enumerate(scenario.ground):
        if isinstance(piece, Stairs) and piece.known:
            yield Finding("ground", "ok", f"ground.{index}.rise", _within_reach(scenario, biped, index))


def largest_rise(scenario: Scenario, biped: Biped, index: int) -> float:
    """The largest rise of stairs that the legs reach, of the sign of theirs, at the scenario's CoM height [m]."""
    stairs = scenario.ground[index]
    assert isinstance(stairs, Stairs)
    sign, low, high = (1.0 if stairs.rise > 0.0 else -1.0), 0.0, _HIGHEST * biped.config.com_height
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _reached(scenario, biped, stairs, sign * middle) else (low, middle)
    return sign * low


def _reached(scenario: Scenario, biped: Biped, stairs: Stairs, rise: float) -> bool:
    alone: tuple[Piece, ...] = (stairs.model_copy(update={"rise": rise, "count": min(stairs.count, 3)}),)
    gait = commanded_gait(scenario.model_copy(update={"ground": alone}))
    return not any(step.missed for step in uneven_steps(biped, gait, reserve=0.0))


def _check_sides(scenario: Scenario, biped: Biped, gait: Gait) -> None:
    """Raises `InputError` where a foot is to stand over the side of its surface."""
    terrain = scenario.terrain
    for step in map(gait.step, range(len(gait.footsteps.listed))):
        if step.side == BOTH:
            continue
        length, width = biped.soles["left" if step.side == LEFT else "right"].half_size.tolist()
        for along, across in product((-length, length), (-width, width)):
            beside = terrain.height(step.x + along, step.y + across)
            if abs(beside - step.height - along * step.slope[0] - across * step.slope[1]) > _LEVEL:
                raise InputError(
                    f"{_named(scenario, step.x)} puts the sole over the side of its surface, which must reach "
                    f"from y = {step.y - width:.3g} to {step.y + width:.3g} m"
                )


def _named(scenario: Scenario, place: float) -> str:
    """The step with its stance at x [m], and the piece of ground that it is on."""
    index = _piece(scenario, place)
    return f"the step at x = {place:.2f} m" + (
        "" if index is None else f" on ground.{index} ({scenario.ground[index].kind})"
    )


def _piece(scenario: Scenario, place: float) -> int | None:
    """The first piece of the map that is at most a leg away from x [m]."""
    spans = [(piece.span(), index) for index, piece in enumerate(scenario.ground) if piece.known]
    reach = scenario.gait.com_height
    return next((index for (low, high), index in spans if low - reach <= place <= high + reach), None)


def _rise(scenario: Scenario, biped: Biped, place: float) -> str:
    """What rise of the stairs at x [m] is within reach, beside theirs; empty where there are none."""
    index = _piece(scenario, place)
    piece = None if index is None else scenario.ground[index]
    if index is None or not isinstance(piece, Stairs):
        return ""
    return f"{_within_reach(scenario, biped, index)} (given: {piece.rise:g})"


def _within_reach(scenario: Scenario, biped: Biped, index: int) -> str:
    """The largest rise of stairs at the scenario's CoM height, and at that of a few others which allows the most."""
    heights = [scenario.gait.com_height, *(round(factor * biped.config.com_height, 3) for factor in _HEIGHTS)]
    rises = [largest_rise(_at_height(scenario, height), biped, index) for height in heights]
    best = max(range(len(rises)), key=lambda i: abs(rises[i]))
    said = f"a rise of up to {rises[0]:.2g} m is within reach with the CoM at {heights[0]:g} m, as here"
    if best:
        said += f", and of up to {rises[best]:.2g} m with it at {heights[best]:g} m"
    return said


def _at_height(scenario: Scenario, height: float) -> Scenario:
    return scenario.model_copy(update={"gait": scenario.gait.model_copy(update={"com_height": height})})
