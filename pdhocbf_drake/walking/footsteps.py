"""Footsteps as data: which foot stands where and when, and how a list of footsteps goes on after its end."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.walking.commands import Command
from pdhocbf_drake.walking.config import GaitConfig
from pdhocbf_drake.walking.course import Course
from pdhocbf_drake.walking.known_ground import KnownGround
from pdhocbf_drake.walking.sides import BOTH, LEFT, RIGHT

LEVEL = 0.0, 0.0
ANYWHERE = -math.inf, math.inf


class Footstep(NamedTuple):
    """One step as commanded.

    Attributes:
        side: the stance foot: +1 left, −1 right, 0 both feet side by side.
        x, y: centre of the stance foot in the world, or the middle between both feet [m].
        yaw: heading of the stance [rad].
        height: height of the ground under the stance [m].
        start: first tick of the step.
        ticks: duration of the step [ticks].
        slope: ∂z/∂x and ∂z/∂y of the ground there [1].
        window: where along x the foot may land and stand on the same ground [m].
    """

    side: int
    x: float
    y: float
    yaw: float
    height: float
    start: int
    ticks: int
    slope: tuple[float, float] = LEVEL
    window: tuple[float, float] = ANYWHERE

    def ground(self, x: float, y: float) -> float:
        """Height at a place of the plane that the foot stands on [m]."""
        return self.height + self.slope[0] * (x - self.x) + self.slope[1] * (y - self.y)


class Resumed(NamedTuple):
    """Steps in place of a stand, by which a robot that is pushed there keeps its balance.

    Attributes:
        tick: the tick from which on a foot swings; −1 where the walk is as commanded.
        side: the stance foot of the step with that tick: +1 left, −1 right; the feet alternate from there on.
        last: the last such step; single-support steps of the walk among them stay as they are.
    """

    tick: int = -1
    side: int = 0
    last: int = -1


AS_COMMANDED = Resumed()


@dataclass(frozen=True)
class Footsteps:
    """The footsteps of a whole walk; `footsteps[j]` is that of step j, for any integer j.

    Footstep −1 is the stand from which the walk starts; it holds for all earlier steps as well. After the end of the
    list its last two footsteps repeat, each time displaced by `advance`. After step `last` both feet stand side by
    side, and where steps are `resumed`, in place of a stand, they alternate.

    Attributes:
        listed: footsteps −1, 0, …; the last two of them are single-support steps.
        advance: displacement of the walk in two steps, along x and y [m].
        width: lateral distance between the feet of a stand [m].
        last: the last single-support step; None for a walk without an end.
        resumed: the steps that take the place of a stand.
        known_ground: the ground where it is not level; None for level ground.
    """

    listed: tuple[Footstep, ...]
    advance: tuple[float, float]
    width: float
    last: int | None = None
    resumed: Resumed = AS_COMMANDED
    known_ground: KnownGround | None = None

    def __getitem__(self, step: int) -> Footstep:
        this = self._placed(step)
        if self.known_ground is None:
            return this
        height, slope, window = self.known_ground.under(this.x, this.y)
        return this._replace(height=height, slope=slope, window=window)

    def _placed(self, step: int) -> Footstep:
        this = self._commanded(step)
        first = self.resumed.tick // this.ticks
        if this.side != BOTH or not (self.resumed.tick >= 0 and first <= step <= self.resumed.last):
            return this
        side = self.resumed.side * (-1) ** (step - first)
        aside = side * self.aside(step)
        return this._replace(side=side, x=this.x - aside * math.sin(this.yaw), y=this.y + aside * math.cos(this.yaw))

    def _commanded(self, step: int) -> Footstep:
        if self.last is None or step <= self.last:
            return self._before_the_end(step)
        end = self._before_the_end(self.last)
        across = end.side * self.aside(self.last)  # from the middle between both feet to the stance foot
        return end._replace(
            side=BOTH,
            x=end.x + across * math.sin(end.yaw),
            y=end.y - across * math.cos(end.yaw),
            start=end.start + (step - self.last) * end.ticks,
        )

    def ending_at(self, step: int) -> Footsteps:
        """The same footsteps up to step j, then a stand with the feet side by side; an earlier end is kept."""
        return replace(self, last=step if self.last is None else min(step, self.last))

    def resumed_by(self, resumed: Resumed) -> Footsteps:
        """The same footsteps with steps in place of a stand."""
        return replace(self, resumed=resumed)

    @property
    def end(self) -> int | None:
        """The last single-support step, a resumed one included; None for a walk without an end."""
        return None if self.last is None else max(self.last, self.resumed.last)

    def seen(self, step: int) -> Footsteps:
        """The same, as they are expected at step j; without commands to come all is known."""
        return self

    def aside(self, step: int) -> float:
        """Distance of the feet from the middle between them in step j [m]."""
        return self.width / 2.0

    @property
    def sole(self) -> tuple[float, float] | None:
        """Half length and half width of the soles, where footholds are to keep them apart; None elsewhere [m]."""
        return None

    @property
    def turns(self) -> bool:
        """Whether a footstep may have another heading than 0."""
        return False

    def path(self, step: int) -> tuple[float, ...]:
        """See `Gait.path`."""
        return ()

    def asked(self, step: int) -> tuple[float, ...]:
        """See `Gait.asked`."""
        return ()

    def granted(self, asked: Command) -> Command:
        """What is granted of a command; all of it where legs and soles don't limit it."""
        return asked

    def following(self, course: Course | None) -> Footsteps:
        """The same: no command changes it."""
        return self

    def course_after(self, step: int, asked: Command | None, held: bool = False) -> Course | None:
        """None: no command changes the walk."""
        return None

    def holding(self, step: int) -> Course | None:
        """The course of step j from which on it turns no more; None where it does not turn, or is to go on turning."""
        return None

    def replanned(self, step: int, stance: tuple[float, float], yaw: float) -> Course | None:
        """The course of step j from where its stance is [m] and faces [rad]; None for a walk that keeps its path."""
        return None

    def settled(self, step: int) -> bool:
        """Whether the walk goes on in step j as it was commanded in the step before."""
        return True

    def with_stride(self, stride: float, step: int) -> Footsteps:
        """The same footsteps up to step j, and from there on single-support steps `stride` [m] apart along x."""
        listed = [self._before_the_end(j) for j in range(-1, max(step + 2, len(self.listed) - 1))]
        for i in range(max(step + 2, 1), len(listed)):
            before, this = listed[i - 1 : i + 1]
            walks = before.side != BOTH and this.side != BOTH
            listed[i] = this._replace(x=before.x + stride if walks else before.x)
        return replace(self, listed=tuple(listed), advance=(2.0 * stride, self.advance[1]))

    def _before_the_end(self, step: int) -> Footstep:
        listed = self.listed
        if step < -1:
            return listed[0]._replace(start=listed[0].start + (step + 1) * listed[0].ticks)
        if step < len(listed) - 1:
            return listed[step + 1]
        ahead = step - (len(listed) - 3)  # steps since the last but one
        rounds, place = divmod(ahead, 2)
        first, this = listed[-2], listed[-2 + place]
        # Half of `advance` for each step, plus what the second footstep deviates from that (0 in a straight walk), so
        # that x of a straight walk is the product stride · ahead, rounded once.
        x, y = (
            origin + ahead * (way / 2.0) + (own - (origin + place * (way / 2.0)))
            for origin, own, way in zip(first[1:3], this[1:3], self.advance, strict=True)
        )
        return this._replace(x=x, y=y, start=this.start + rounds * (first.ticks + listed[-1].ticks))


def commanded_footsteps(config: GaitConfig) -> Footsteps:
    """The footsteps that the `gait` keys describe: a stand, a straight walk along x from x = 0, and a stand at its end.

    Raises:
        InputError: the stride is not finite.
    """
    if not math.isfinite(config.stride):
        raise InputError(f"gait.stride: a finite length in metres is needed (given: {config.stride})")
    ticks, begin = config.ticks_per_step, config.start_steps
    first = LEFT if config.first_stance == "left" else RIGHT
    listed = [Footstep(BOTH, 0.0, 0.0, 0.0, 0.0, step * ticks, ticks) for step in range(-1, begin)]
    for ahead, side in enumerate((first, -first)):
        y = side * config.stance_width / 2.0
        listed.append(Footstep(side, config.stride * ahead, y, 0.0, 0.0, (begin + ahead) * ticks, ticks))
    last = None if config.walk_steps is None else begin + config.walk_steps - 1
    return Footsteps(tuple(listed), (2.0 * config.stride, 0.0), config.stance_width, last)
