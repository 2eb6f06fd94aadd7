"""A validated walk: footsteps, their timing, the support region and the CoM height."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.kept import Kept
from pdhocbf_drake.walking.com_height import GRAVITY, CosineHeight
from pdhocbf_drake.walking.config import GaitConfig
from pdhocbf_drake.walking.course import Course
from pdhocbf_drake.walking.footsteps import Footstep, Footsteps, Resumed, commanded_footsteps
from pdhocbf_drake.walking.quantities import stance_sides
from pdhocbf_drake.walking.sides import BOTH
from pdhocbf_drake.walking.support import SupportRegion
from pdhocbf_drake.walking.swing_profile import SwingProfile, Timing

_SEEN = 3  # steps from a stand on, in which a swing is looked for


class Gait:
    """Which foot stands where at tick k, where the ZMP may be, and how high the CoM is.

    Step j holds ticks jN … jN + N − 1. In single support one foot stands while the other one swings to the next
    foothold; during the first D ticks both are on the ground. Where a walk begins and ends, both feet stand.

    Other walks are derived from this one (`following`, `ending_at`, `resumed_by`, `with_box`, `with_stride`), so that
    its footsteps are kept.

    Attributes:
        config: the `gait` keys that the walk was first made from; where it was derived from another walk, `footsteps`
            and not the config's stride and number of steps say where it goes.
        footsteps, step: the commanded footsteps; `step(j)` is `footsteps[j]`, kept for the next call.
        seen: `footsteps.seen`, likewise; what step j commands of steps j + 2, j + 3, … is found there.
        flipped: whether in step j the other foot stands than `stance_sides` says, as after some stands; in a stand,
            whether that holds for the next swing. Kept, too.
        period: N [ticks].
        height: CoM height, eq. (24).
        region: the support region, eq. (27).
        planes: what step j − 1, j and j + 1 stand on: height at the world's origin [m], ∂z/∂x and ∂z/∂y, (3, 3). Kept.
        profiles: of the swings of step j and of the two that follow it. Kept; made when it is first asked for.

    Raises:
        InputError: double support takes half a step or more, the stride is not finite, `CosineHeight` refuses the CoM
            height, or a footstep has another timing.
    """

    def __init__(self, config: GaitConfig, footsteps: Footsteps | None = None) -> None:
        """A walk on the given footsteps, or on those that the config describes."""
        self.config = config
        self.period = config.ticks_per_step
        self.height = CosineHeight(config)
        self.footsteps = commanded_footsteps(config) if footsteps is None else footsteps
        if config.double_support_ticks >= self.period // 2:
            raise InputError(
                f"gait.double_support_ticks: must be below half a step, {self.period // 2} ticks "
                f"(given: {config.double_support_ticks})"
            )
        for index, step in enumerate(self.footsteps.listed, start=-1):
            if (step.start, step.ticks) != (index * self.period, self.period):
                raise InputError(
                    f"footstep {index}: must start at tick {index * self.period} and last gait.ticks_per_step, "
                    f"{self.period} ticks (given: {step.start}, {step.ticks})"
                )
        self.region = SupportRegion(config)
        self.step = lru_cache(maxsize=64)(self.footsteps.__getitem__)
        self.seen = lru_cache(maxsize=4)(self.footsteps.seen)
        self.flipped = lru_cache(maxsize=8)(self._flipped)
        self.planes = lru_cache(maxsize=4)(self._planes)
        self.profiles = lru_cache(maxsize=4)(self._profiles)
        self._rises = lru_cache(maxsize=4)(self._rise)
        self._endings: dict[int, Gait] = {}
        self._resumed: dict[Resumed, Gait] = {}
        self._following = Kept[Gait](4)

    @property
    def turns(self) -> bool:
        """Whether a foot may have another heading than straight ahead along x."""
        return self.footsteps.turns

    @property
    def uneven(self) -> bool:
        """Whether the ground is not level."""
        return self.footsteps.known_ground is not None

    def rise(self, step: int) -> float:
        """Height that the ground rises by before and after step j alike, in tenths of millimetres; else 0 [m].

        0 in a stand and on a slope, where the CoM moves in parallel to the plane and eta is that of level ground.
        """
        return self._rises(step)

    def _rise(self, step: int) -> float:
        last, this, coming = self.step(step - 1), self.step(step), self.seen(step)[step + 1]
        sloping = any(any(stance.slope) for stance in (last, this, coming))
        before, after = round(this.height - last.height, 4), round(coming.height - this.height, 4)
        return before if before == after and not sloping and this.side != BOTH else 0.0

    @property
    def rises(self) -> set[float]:
        """The even rises of the walk's footsteps [m]."""
        if not self.uneven:
            return set()
        return {self.rise(step) for step in range(len(self.footsteps.listed))} - {0.0}

    def eta(self, rise: float = 0.0) -> np.ndarray:
        """eta of a walk with an even rise over one step, shape (N,) [1/s²].

        eta_k = (z̈ + g)/(z + r ((q − N/2)/N + 1 − w_q)): the ground's line under the CoM climbs by r in a step and meets
        the stance foot at its middle, see `ComLine`; the ZMP climbs with its box in double support, see
        `SupportRegion`.
        """
        if not rise:
            return self.height.eta()
        q, weight = np.arange(self.period), self.region.weight
        z, _, acceleration = np.array([self.height(tick) for tick in range(self.period)]).T
        return np.asarray((acceleration + GRAVITY) / (z + rise * (q / self.period - 0.5 + 1.0 - weight)))

    def _planes(self, step: int) -> np.ndarray:
        seen = self.seen(step)
        stances = self.step(step - 1), self.step(step), seen[step + 1]
        return np.array([[stance.ground(0.0, 0.0), *stance.slope] for stance in stances])

    def _profiles(self, step: int) -> tuple[SwingProfile, ...]:
        seen = self.seen(step)
        steps = self.step(step - 1), *(seen[step + i] for i in range(4))
        return tuple(self._profile(*three) for three in zip(steps, steps[1:], steps[2:], strict=False))

    def _profile(self, last: Footstep, this: Footstep, coming: Footstep) -> SwingProfile:
        """Of the swing from one stance over the next to the one after that."""
        usual, ground = SwingProfile(apex=self.config.swing_height), self.footsteps.known_ground
        if ground is None or this.side == BOTH:
            return usual
        timing = Timing(self.swing_ticks(), self.config.tick)
        return ground.swing((last.x, last.y), (coming.x, coming.y), timing, usual.apex)

    def path(self, step: int) -> tuple[float, ...]:
        """Middle between the feet and heading of step j as commanded [m, rad], and its command as granted.

        The latter is the velocity ahead and aside, the turn rate, and whether it walks [m/s, rad/s, 1]; a walk that
        follows no commands has none.
        """
        return self.footsteps.path(step)

    def asked(self, step: int) -> tuple[float, ...]:
        """The command of step j before its limits, as the last four numbers of `path`; without commands none."""
        return self.footsteps.asked(step)

    def following(self, course: Course | None) -> Gait:
        """This walk as it goes on after the course of its present step, where commands become known as it walks."""
        if course is None:
            return self
        return self._following.get(course, lambda: Gait(self.config, self.footsteps.following(course)))

    def foot_yaws(self, step: int) -> tuple[float, float, float, float]:
        """Headings of the left foot at the start and at the end of step j, then of the right one [rad]."""
        here = self.step(step)
        if here.side == BOTH:
            return (here.yaw,) * 4
        swing = self.step(step - 1).yaw, self.step(step + 1).yaw
        return (here.yaw, here.yaw, *swing) if here.side > 0 else (*swing, here.yaw, here.yaw)

    def phase(self, tick: int) -> tuple[int, int]:
        """(step index j, tick q within the step) of tick k = jN + q."""
        return divmod(tick, self.period)

    def support(self, step: int) -> int:
        """+1 left, −1 right, 0 both feet during step j."""
        return self.step(step).side

    def foothold(self, step: int) -> np.ndarray:
        """Commanded centre of the stance of step j: of one foot, or between both [m], shape (2,)."""
        footstep = self.step(step)
        return np.array([footstep.x, footstep.y])

    @property
    def feet_at_start(self) -> np.ndarray:
        """Centres of the left and of the right foot in the stand from which the walk starts, shape (2, 2) [m]."""
        start, half = self.step(-1), self.footsteps.width / 2.0
        aside = np.array([-half * math.sin(start.yaw), half * math.cos(start.yaw)])
        return np.array([start.x, start.y]) + np.array([aside, -aside])

    @property
    def has_end(self) -> bool:
        """Whether the walk comes to a stand."""
        return self.footsteps.last is not None

    def ending_at(self, step: int) -> Gait:
        """The same walk, whose last swing is that of step j; after it both feet stand side by side."""
        if step not in self._endings:
            self._endings[step] = Gait(self.config, self.footsteps.ending_at(step))
        return self._endings[step]

    def ended_by(self, last_step: float) -> Gait:
        """This walk, or where a controller has set a last step (not −1), the one that ends there."""
        return self if last_step < 0 else self.ending_at(round(last_step))

    def resumed_by(self, resumed: Resumed) -> Gait:
        """The same walk with steps in place of a stand."""
        if resumed == self.footsteps.resumed:
            return self
        if resumed not in self._resumed:
            self._resumed[resumed] = Gait(self.config, self.footsteps.resumed_by(resumed))
        return self._resumed[resumed]

    def _flipped(self, step: int) -> bool:
        expected, seen = stance_sides(self.config), self.seen(step)
        sides = (seen[step + i].side for i in range(_SEEN))
        return next((side != expected[(step + i) % 2] for i, side in enumerate(sides) if side != BOTH), False)

    def lift_off(self, step: int) -> int:
        """Ticks from the start of step j until its foot swings: double support, or until a walk is resumed."""
        first, tick = self.phase(self.footsteps.resumed.tick)
        return max(self.config.double_support_ticks, tick if step == first else 0)

    def with_box(self, zmp_box: tuple[float, float]) -> Gait:
        """The same walk with another ZMP box, side lengths in x and y [m]."""
        return Gait(self.config.model_copy(update={"zmp_box": zmp_box}), self.footsteps)

    def with_stride(self, stride: float, step: int) -> Gait:
        """The same walk up to step j, and from there on footsteps `stride` [m] apart along x."""
        return Gait(self.config, self.footsteps.with_stride(stride, step))

    def swing_ticks(self) -> int:
        """Ticks of a step during which the swing foot is in the air."""
        return self.period - self.config.double_support_ticks
