"""Class-K functions α: the largest decrease α(h) of h in a tick.

Lemma 1 of the paper holds only for α(s) ≤ s on s ≥ 0 (for α(s) = 2s, b(k+1) − b(k) ≥ −α(b(k)) allows
b(1) = −b(0)), so every function used by a barrier is checked for it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np

from pdhocbf_drake.barriers.checks import finite_number, is_number, one_number, shown
from pdhocbf_drake.errors import InputError

# Arguments at which a class-K function of another form is sampled: from far below to far above any unit in use.
_SAMPLES = np.logspace(-9, 6, 151)
_ROUNDING = 1e-12


@runtime_checkable
class ClassK(Protocol):
    """A class-K function, extended to s < 0: increasing, α(0) = 0, and α(s) ≤ s for s ≥ 0.

    It takes a float; in `add_nonlinear_barrier_rows` also Drake's AutoDiffXd (NumPy's functions accept both). s < 0
    belongs to states outside the safe set, where −α(s) is the part of the violation that must vanish within a tick.
    """

    def __call__(self, s: Any) -> Any: ...


@dataclass(frozen=True)
class Linear:
    """α(s) = γ·s.

    ψ ≥ 0 then leaves h(k+1) ≥ (1−γ) h(k): inside, at most the share γ of the margin is used up in a tick;
    outside, h recovers at that same rate, h(k) ≥ (1−γ)^k h(0).

    Attributes:
        gamma: γ in (0, 1] [1]. γ = 1 requires only h(k+1) ≥ 0: a plain moving limit, the most brittle choice.

    Raises:
        InputError: γ is outside (0, 1].
    """

    gamma: float

    def __post_init__(self) -> None:
        if not is_number(self.gamma):
            raise InputError(f"class-K rate gamma must be a number in (0, 1], given {shown(self.gamma)}")
        if not 0 < self.gamma <= 1:  # NaN too
            raise InputError(
                f"class-K rate gamma = {self.gamma} is outside (0, 1]: alpha(s) = gamma*s must rise, and not above s"
            )

    def __call__(self, s: Any) -> Any:
        return self.gamma * s


@dataclass(frozen=True)
class Saturating:
    """α(s) = γ·σ·tanh(s/σ): linear near the edge, at most γ·σ away from it.

    Inside, h may fall by no more than γσ per tick; outside, it need rise by no more than that, so that a controller
    with limited input can still satisfy ψ ≥ 0 after a large disturbance.

    Attributes:
        gamma: γ in (0, 1], the slope at 0 [1].
        scale: σ > 0, where the saturation sets in [unit of h].

    Raises:
        InputError: γ is outside (0, 1], or σ is not positive and finite.
    """

    gamma: float
    scale: float

    def __post_init__(self) -> None:
        Linear(self.gamma)  # the same range, the same sentence
        if not finite_number("class-K scale", self.scale) > 0:
            raise InputError(f"class-K scale = {self.scale} must be positive")

    def __call__(self, s: Any) -> Any:
        return self.gamma * self.scale * np.tanh(s / self.scale)


def as_class_k(alpha: ClassK | float) -> ClassK:
    """α itself, or α(s) = γ·s for a number γ; raises `InputError` if it is neither, or γ is outside (0, 1]."""
    return alpha if callable(alpha) else Linear(alpha)


def check_class_k(alpha: ClassK, where: str) -> None:
    """Refuses a function for which Lemma 1 fails, by samples at 151 points over 15 decades on either side of 0.

    Raises:
        InputError: α raises an exception or gives no number, α(0) ≠ 0, α is not increasing, or α(s) > s at some s > 0,
            the first of which is named.
    """
    if isinstance(alpha, (Linear, Saturating)):
        return  # true by construction: tanh(s) ≤ s for s ≥ 0

    def value(s: float) -> float:
        try:
            found = alpha(s)
        except Exception as error:
            raise InputError(
                f"{where}: alpha({s:g}) raised {type(error).__name__} ({error}); it takes one number"
            ) from error
        return float(one_number(f"{where}: alpha({s:g})", found))

    at_zero = value(0.0)
    if at_zero != 0:
        raise InputError(f"{where}: alpha(0) = {at_zero:g}, but a class-K function is 0 at 0")
    values = np.array([value(float(s)) for s in _SAMPLES])
    mirrored = np.array([value(-float(s)) for s in _SAMPLES])
    # Far from 0 a bounded function may be constant within rounding, but near 0 it must differ from 0.
    both = np.concatenate([mirrored[::-1], [0.0], values])
    if not (np.all(np.isfinite(both)) and np.all(np.diff(both) >= 0) and values[0] > 0 and mirrored[0] < 0):
        raise InputError(f"{where}: alpha is not increasing, but a class-K function (extended to s < 0) is")
    above = np.flatnonzero(values > _SAMPLES * (1 + _ROUNDING))
    if above.size:
        s, value = _SAMPLES[above[0]], values[above[0]]
        raise InputError(
            f"{where}: alpha({s:g}) = {value:g} is above s, but alpha(s) <= s is needed for s >= 0: "
            "otherwise psi >= 0 does not keep h >= 0"
        )
