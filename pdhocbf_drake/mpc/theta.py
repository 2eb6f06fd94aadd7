"""θ: what changes from tick to tick in the program of one axis, put together from gait, plan and measurement."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache

import numpy as np

from pdhocbf_drake.jit import compiled
from pdhocbf_drake.mpc.axis_program import Parameters
from pdhocbf_drake.mpc.config import MpcConfig
from pdhocbf_drake.mpc.plan import Plan
from pdhocbf_drake.mpc.steps import StepPreview
from pdhocbf_drake.mpc.terminal_set import RELAXED
from pdhocbf_drake.walking import Gait
from pdhocbf_drake.walking.divergent import DivergentComponent

_NONE = np.zeros(0)
_NO_ROW = np.zeros(3)


class Theta:
    """θ of one axis at one tick.

    Attributes:
        layouts: where each part of it lies, by axis.
        preview: what the gait commands over the horizon.
    """

    def __init__(
        self, gait: Gait, config: MpcConfig, divergent: DivergentComponent, names: tuple[Sequence[str], Sequence[str]],
        ends: tuple[int, int],
    ) -> None:  # fmt: skip
        """
        Args:
            names: of the barriers of each axis.
            ends: steps in the period of each axis' terminal set, 0 where it has none.
        """
        self._gait, self._config, self._names, self._ends = gait, config, names, ends
        self._divergent = divergent
        self.preview = StepPreview(gait, config, divergent)
        horizon, footholds = config.horizon, config.horizon // gait.period
        self._footholds, self._horizon, self._shapes = footholds, horizon, ((3,), (2,), (horizon,))
        self.layouts = [Parameters(footholds, horizon, names[axis], ends[axis]) for axis in (0, 1)]
        self._of_step = lru_cache(maxsize=4)(self._step_parameters)
        self._periodic_tail = [
            float(divergent.discounts(phase, horizon)[-1]) * divergent.offset_row(phase) for phase in range(gait.period)
        ]
        names_of_starts = ("state", "stance", "target", "tail", "offset")
        self._starts = [tuple(axis.places[name].start for name in names_of_starts) for axis in self.layouts]

    def ending_at(self, step: int) -> Theta:
        """The same for a walk whose last swing is that of step j."""
        return Theta(self._gait.ending_at(step), self._config, self._divergent, self._names, self._ends)

    def __call__(
        self, axis: int, tick: int, state: np.ndarray, stance: np.ndarray, bounds: Mapping[str, np.ndarray],
        offset: np.ndarray | None, plan: Plan | None,
    ) -> np.ndarray:  # fmt: skip
        """The parameters of one axis at one tick, laid out as `Parameters` says.

        Raises:
            ValueError: state, stance or offset is of another shape than (3,), (2,), (H,).
        """
        shapes = state.shape, stance.shape, (self._horizon,) if offset is None else offset.shape
        if shapes != self._shapes:  # machine code would read beyond them
            raise ValueError(f"state, stance and offset of an axis must have shapes {self._shapes}, given {shapes}")
        step, phase = self._gait.phase(tick)
        place, here = self.layouts[axis].places, float(stance[1])
        of_step, centre, repeats = self._of_step(axis, step)
        correction = self._config.path_correction[axis]
        towards = here + min(max(centre - here, -correction), correction)
        row, tail = _NO_ROW, 0.0
        if repeats and self._config.tail == "periodic":
            row = self._periodic_tail[phase]
        elif self._config.tail != "truncated":
            tail = float(self.preview.anticipative_tail(tick)[axis])
        theta, shift = of_step.copy(), _NONE if offset is None else offset
        _fill(theta, self._starts[axis], self._footholds, state, stance, towards, row, tail, shift)
        if plan is not None and plan.tick // self._gait.period == step:
            self._hold_landing(theta, place, phase, plan.footholds[axis, 0] - here)
        for name in self._names[axis]:
            theta[place[f"bound_{name}"]] = bounds[name]
        if self._ends[axis]:
            # Where the plan ends: H is a multiple of two steps, so at a step of the same parity.
            count = self._ends[axis]
            in_force = (np.arange(count) == step % count) & repeats
            theta[place["terminal"]] = np.where(in_force, 0.0, RELAXED)
        return theta

    def _hold_landing(self, theta: np.ndarray, place: Mapping[str, slice], phase: int, planned: float) -> None:
        """Narrows the limits of the next step to what the swing foot can still do, around the step planned so far."""
        config, gait = self._config, self._gait
        low, high = place["step_lower"].start, place["step_upper"].start
        left = gait.period - phase - config.freeze_ticks
        if left <= 0:
            theta[low] = theta[high] = planned
        elif config.swing_acceleration is not None and phase > gait.config.double_support_ticks:
            room = config.swing_acceleration / 10.0 * (left * gait.config.tick) ** 2
            theta[low] = min(max(theta[low], planned - room), theta[high])
            theta[high] = max(min(theta[high], planned + room), theta[low])

    def _step_parameters(self, axis: int, step: int) -> tuple[np.ndarray, float, bool]:
        """What holds all through a step: its part of θ (targets as seen from the stance, else zeros), its centre, and
        whether a gait repeats over the horizon.
        """
        ahead, place = self.preview.steps(step), self.layouts[axis].places
        theta = np.zeros(self.layouts[axis].size)
        theta[place["target"]] = np.cumsum(ahead.moves[axis])
        theta[place["step_lower"]] = ahead.lower[axis]
        theta[place["step_upper"]] = ahead.upper[axis]
        theta[place["half"]] = ahead.half[axis]
        return theta, float(ahead.centre[axis]), self.preview.repeats(step)


@compiled
def _fill(
    theta: np.ndarray, starts: tuple[int, int, int, int, int], footholds: int, state: np.ndarray,
    stance: np.ndarray, towards: float, row: np.ndarray, tail: float, offset: np.ndarray,
) -> None:  # fmt: skip
    """Adds what this tick brings, at the `starts` of its parts, to what holds all through the step."""
    at_state, at_stance, at_target, at_tail, at_offset = starts
    theta[at_tail] = tail
    for i in range(3):
        theta[at_state + i] = state[i]
        theta[at_tail] += row[i] * state[i]
    for i in range(2):
        theta[at_stance + i] = stance[i]
    for i in range(footholds):
        theta[at_target + i] += towards
    for i in range(len(offset)):
        theta[at_offset + i] = offset[i]
