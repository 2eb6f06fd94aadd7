"""The configuration of a barrier and of its bound."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field, field_validator, model_validator

from pdhocbf_drake.barriers.class_k import ClassK, Linear, Saturating
from pdhocbf_drake.config import Config
from pdhocbf_drake.errors import InputError

Side = Literal["upper", "lower"]
BoundKind = Literal["constant", "harmonic", "tabulated", "orbit", "orbit_peak"]
Keys = tuple[str, ...]


class BoundConfig(Config):
    """A periodic bound V̄(k).

    Attributes:
        kind: "constant"; "harmonic"; "tabulated"; "orbit", the nominal orbit of the bounded quantity plus a
            margin (a periodic bound); "orbit_peak", the constant that clears the whole orbit by that margin.
        value: the constant [unit of h].
        mean, cosine, sine: V̄(k) = mean + cosine·cos(2πk/N) + sine·sin(2πk/N) [unit of h]; cosine and sine are 0 unless
            they are given.
        values: one period of a table, one value a tick [unit of h].
        margin: distance from the nominal orbit, outwards [unit of h].
    """

    KEYS: ClassVar[dict[str, tuple[Keys, Keys]]] = {
        "constant": (("value",), ()),
        "harmonic": (("mean",), ("cosine", "sine")),
        "tabulated": (("values",), ()),
        "orbit": ((), ("margin",)),
        "orbit_peak": ((), ("margin",)),
    }
    """For each kind the required and the optional keys."""

    kind: BoundKind
    value: float | None = None
    mean: float | None = None
    cosine: float | None = None
    sine: float | None = None
    values: tuple[float, ...] | None = Field(None, min_length=1)
    margin: float | None = None

    @property
    def follows_orbit(self) -> bool:
        """Whether V̄ is made from the nominal orbit."""
        return self.kind in ("orbit", "orbit_peak")

    @model_validator(mode="after")
    def _keys_match_kind(self) -> BoundConfig:
        needed, optional = self.KEYS[self.kind]
        given = {key for key in type(self).model_fields if key != "kind" and getattr(self, key) is not None}
        allowed = ", ".join((*needed, *optional))
        if missing := [key for key in needed if key not in given]:
            raise ValueError(f'a bound of kind "{self.kind}" needs {missing[0]}; it takes: {allowed}')
        if self.margin is not None and self.margin < 0.0:
            raise ValueError(f"margin must be at least 0: the orbit itself would be outside (given: {self.margin:g})")
        if unused := sorted(given - {*needed, *optional}):
            raise ValueError(f'a bound of kind "{self.kind}" does not use {unused[0]}; it takes: {allowed}')
        return self


class BarrierConfig(Config):
    """A barrier h = V̄(k) − q (upper) or q − V̄(k) (lower) on a scalar quantity q = n·x of the state.

    Attributes:
        side: which side of the bound is safe: below an "upper" one, above a "lower" one.
        bound: V̄(k).
        gamma: γ_1, …, γ_m in (0, 1], one per class-K function [1]; their number is the order m of ψ_m.
        class_k: "linear" α(s) = γ·s, or "saturating" α(s) = γ·σ·tanh(s/σ), which is for `BarrierFilter` and
            `add_nonlinear_barrier_rows`: a scenario's MPC is a quadratic program and takes linear ones only.
        class_k_scale: σ of the saturating one [unit of h].
        relative_degree: declared by the user, checked against the dynamics; null declares the order m.
        unit: unit of h, for tables and axis labels.
    """

    side: Side = "upper"
    bound: BoundConfig
    gamma: tuple[float, ...] = Field((0.5, 0.5), min_length=1)
    class_k: Literal["linear", "saturating"] = "linear"
    class_k_scale: float | None = Field(None, gt=0)
    relative_degree: int | None = Field(None, ge=1)
    unit: str = ""

    @field_validator("gamma")
    @classmethod
    def _gamma_in_range(cls, gamma: tuple[float, ...]) -> tuple[float, ...]:
        for rate in gamma:
            Linear(rate)
        return gamma

    @model_validator(mode="after")
    def _scale_matches_class_k(self) -> BarrierConfig:
        if (self.class_k == "saturating") != (self.class_k_scale is not None):
            verb = "needs" if self.class_k == "saturating" else "does not use"
            raise ValueError(f'class_k "{self.class_k}" {verb} class_k_scale')
        return self

    def make_class_k(self) -> tuple[ClassK, ...]:
        """α_1, …, α_m."""
        if self.class_k == "linear":
            return tuple(Linear(rate) for rate in self.gamma)
        if self.class_k_scale is None:
            raise InputError('class_k "saturating" needs class_k_scale')
        return tuple(Saturating(rate, self.class_k_scale) for rate in self.gamma)
