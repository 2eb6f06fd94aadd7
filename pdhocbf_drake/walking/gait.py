"""The stance sequence of a walk: standing start, single-support steps, and a stand at the end."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.walking.com_height import CosineHeight
from pdhocbf_drake.walking.config import GaitConfig

LEFT, BOTH, RIGHT = 1, 0, -1


@dataclass(frozen=True)
class Step:
    """What the ZMP may do during one step, as commanded.

    Attributes:
        support: +1 left foot, −1 right foot, 0 both feet (standing).
        centre: centre of the ZMP box, (x, y) in the world [m].
        half: half side lengths of the ZMP box [m].
        landing: where the swing foot lands at the end of the step [m]; None where nothing swings.
    """

    support: int
    centre: np.ndarray
    half: np.ndarray
    landing: np.ndarray | None


class Gait:
    """A validated walk: which foot stands where at tick k, and how the ZMP box moves.

    Step j holds ticks jN … jN + N − 1. The first `start_steps` steps stand on both feet with the box around both;
    then each step stands on one foot while the other swings; a walk with an end stands on both feet again after it.
    During the first D ticks of a step both feet are on
    the ground and the box moves linearly from the last step's to this step's: phase q has weight
    min(1, (q + 1)/(D + 1)) on this step's box. D = 0 is the paper's (27), a jump of the box in one tick.

    Raises:
        InputError: a horizon, double support or length that cannot be walked.
    """

    def __init__(self, config: GaitConfig) -> None:
        self.config = config
        self.period = config.ticks_per_step
        self.height = CosineHeight(config)
        if not math.isfinite(config.stride):
            raise InputError(f"gait.stride: a finite length in metres is needed (given: {config.stride})")
        if config.double_support_ticks >= self.period // 2:
            raise InputError(
                f"gait.double_support_ticks: must be below half a step, {self.period // 2} ticks "
                f"(given: {config.double_support_ticks})"
            )
        ramp = (np.arange(self.period) + 1.0) / (config.double_support_ticks + 1.0)
        self.box_weight = np.minimum(1.0, ramp)
        self._first = LEFT if config.first_stance == "left" else RIGHT
        self._half = np.array(config.zmp_box) / 2.0
        self._endings: dict[int, Gait] = {}
        self._last_walking = None if config.walk_steps is None else config.start_steps + config.walk_steps - 1

    def phase(self, tick: int) -> tuple[int, int]:
        """(step index j, tick q within the step) of tick k = jN + q."""
        return divmod(tick, self.period)

    def support(self, step: int) -> int:
        """+1 left, −1 right, 0 both feet during step j."""
        if step < self.config.start_steps or (self._last_walking is not None and step > self._last_walking):
            return BOTH
        return self._first if (step - self.config.start_steps) % 2 == 0 else -self._first

    def foothold(self, step: int) -> np.ndarray:
        """Commanded centre of the stance foot of a walking step [m], shape (2,)."""
        ahead = step - self.config.start_steps
        side = self._first if ahead % 2 == 0 else -self._first
        return np.array([self.config.stride * ahead, side * self.config.stance_width / 2.0])

    def step(self, index: int) -> Step:
        """The commanded step j."""
        support = self.support(index)
        if support != BOTH:
            landing = self.foothold(index + 1)
            if index == self._last_walking:
                landing[0] = self.foothold(index)[0]
            return Step(support, self.foothold(index), self._half, landing)
        last = self._last_walking
        first = self.config.start_steps
        x = 0.0 if last is None or last < first or index < first else self.foothold(last)[0]
        half = self._half + np.array([0.0, self.config.stance_width / 2.0])
        return Step(BOTH, np.array([x, 0.0]), half, None)

    def ending_at(self, step: int) -> Gait:
        """The same walk, whose last swing is that of step j; after it both feet stand side by side."""
        if step not in self._endings:
            steps = step - self.config.start_steps + 1
            self._endings[step] = Gait(self.config.model_copy(update={"walk_steps": steps}))
        return self._endings[step]

    def ended_by(self, last_step: float) -> Gait:
        """This walk, or where a controller has set a last step (not −1), the one that ends there."""
        return self if last_step < 0 else self.ending_at(round(last_step))

    def is_standing(self, step: int) -> bool:
        """True where no foot swings during step j."""
        return self.support(step) == BOTH

    def swing_ticks(self) -> int:
        """Ticks of a step during which the swing foot is in the air."""
        return self.period - self.config.double_support_ticks
