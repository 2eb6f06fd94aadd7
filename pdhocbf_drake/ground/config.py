"""The pieces of the ground along x: stairs, slopes, stepping blocks, boards, tiles, and patches of other friction."""

from __future__ import annotations

from abc import abstractmethod
from itertools import pairwise
from typing import Annotated, Any, Literal

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from pdhocbf_drake.config import Config, Length, within

MOST_TILES = 10_000
_Place = Annotated[float, within(-150.0, 150.0, "m")]
_Height = Annotated[float, within(-1.0, 1.0, "m")]
_Side = Annotated[float, within(0.02, 10.0, "m")]
_Angle = Annotated[float, within(-45.0, 45.0, "deg")]
_Amplitude = Annotated[float, within(0.0, 0.2, "m")]
_Friction = Annotated[float, within(0.0, 10.0, "", above=True)]
_FARTHEST = 1000.0  # [m]: end of a piece
_EDGE = 1e-9  # [m]: what lies over an edge by less touches it


class _Piece(Config):
    """A part of the ground; what comes after it, and before the next one, is level.

    Attributes:
        kind: "stairs", "slope", "blocks", "boards", "rough" or "patch".
        known: whether the piece is on the map that the walk is planned with.
        friction: of the piece; null takes the scenario's [1].
    """

    known: bool = True
    friction: _Friction | None = None

    @abstractmethod
    def span(self) -> tuple[float, float]:
        """x where the piece begins, and where it ends [m]."""


class Stairs(_Piece):
    """Steps across x. One step is stairs with a count of 1.

    Attributes:
        at: x of the first edge [m].
        rise: of each step, negative downwards [m].
        tread: length of each step [m].
        count: number of steps.
    """

    kind: Literal["stairs"] = "stairs"
    at: _Place
    rise: _Height
    tread: Length
    count: int = Field(ge=1, le=1000)

    @model_validator(mode="after")
    def _rises(self) -> Stairs:
        if self.rise == 0.0:
            raise ValueError("rise must not be 0: stairs go up, or with a negative rise down")
        return self

    def span(self) -> tuple[float, float]:
        """From the first edge to the end of the last step."""
        return self.at, self.at + self.count * self.tread


class Slope(_Piece):
    """An inclined plane.

    Attributes:
        at: x where it begins [m].
        length: along x [m].
        angle_deg: upwards along x [deg].
        roll_deg: upwards to the left, about the line along x through the start of the walk [deg].
    """

    kind: Literal["slope"] = "slope"
    at: _Place
    length: Annotated[float, within(0.0, 300.0, "m", above=True)]
    angle_deg: _Angle = 0.0
    roll_deg: _Angle = 0.0

    def span(self) -> tuple[float, float]:
        """Along x."""
        return self.at, self.at + self.length


class Blocks(_Piece):
    """Stepping blocks, one a footstep, in a pit.

    Attributes:
        footsteps: x and y of each block's centre, and its height over the level ground before the blocks [m].
        size: of each block along x and y [m].
    """

    kind: Literal["blocks"] = "blocks"
    footsteps: tuple[tuple[_Place, _Place, _Height], ...] = Field(min_length=1, max_length=1000)
    size: tuple[_Side, _Side] = (0.23, 0.15)

    @model_validator(mode="after")
    def _apart(self) -> Blocks:
        for index, (x, y, _) in enumerate(self.footsteps):
            for other, (u, v, _) in enumerate(self.footsteps[:index]):
                if abs(x - u) < self.size[0] - _EDGE and abs(y - v) < self.size[1] - _EDGE:
                    raise ValueError(
                        f"the blocks of footsteps {other} and {index} overlap: they must be {self.size[0]:g} m apart "
                        f"along x or {self.size[1]:g} m along y, or size must be smaller"
                    )
        return self

    def span(self) -> tuple[float, float]:
        """From the first block's edge to the last one's."""
        places = [x for x, _, _ in self.footsteps]
        return min(places) - self.size[0] / 2.0, max(places) + self.size[0] / 2.0


class _Stretch(_Piece):
    """A stretch of ground.

    Attributes:
        from, to: x where it begins and ends [m].
    """

    start: _Place = Field(alias="from")
    to: _Place

    @model_serializer(mode="wrap")
    def _by_keys(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        return {"from" if key == "start" else key: value for key, value in handler(self).items()}

    @model_validator(mode="after")
    def _long(self) -> _Stretch:
        if self.to <= self.start:
            raise ValueError(f"to must be above from, {self.start:g} m (given: {self.to:g})")
        return self

    def span(self) -> tuple[float, float]:
        """Along x."""
        return self.start, self.to


class Patch(_Stretch):
    """Level ground of another friction.

    Attributes:
        friction: of soles on it [1].
    """

    kind: Literal["patch"] = "patch"
    friction: _Friction


class _Rough(_Stretch):
    """Level parts at random heights.

    Attributes:
        amplitude: greatest height over the ground before it, and greatest depth, evenly distributed [m].
        seed: of the heights.
        width: along y, with the start of the walk in its middle; beyond it the ground is level [m].
    """

    amplitude: _Amplitude
    seed: int = Field(0, ge=0, lt=2**32)
    width: Length = 2.0

    @model_validator(mode="after")
    def _few(self) -> _Rough:
        length, width = self.part()
        count = (self.to - self.start) / length * self.width / width
        if count > MOST_TILES:
            raise ValueError(f"{count:.3g} parts are too many: {MOST_TILES} at most; give a greater size or less width")
        return self

    @abstractmethod
    def part(self) -> tuple[float, float]:
        """Size of a part along x and y [m]."""


class Rough(_Rough):
    """Square tiles at random heights, which tilt the soles.

    Attributes:
        size: of a tile [m].
    """

    kind: Literal["rough"] = "rough"
    size: _Side

    def part(self) -> tuple[float, float]:
        """A tile."""
        return self.size, self.size


class Boards(_Rough):
    """Two rows of boards at random heights, one for each foot: a walk along x that fits them stands level.

    The boards to the right begin half a length after those to the left.

    Attributes:
        length: of a board along x, that of two steps [m].
    """

    kind: Literal["boards"] = "boards"
    length: _Side

    def part(self) -> tuple[float, float]:
        """A board."""
        return self.length, self.width / 2.0


Piece = Annotated[Stairs | Slope | Blocks | Boards | Rough | Patch, Field(discriminator="kind")]


def in_order(pieces: tuple[Piece, ...]) -> tuple[Piece, ...]:
    """The pieces along x; raises `ValueError` where two of them are at one place, or one goes too far."""
    order = tuple(sorted(pieces, key=lambda piece: piece.span()))
    for piece in order:
        if (end := piece.span()[1]) > _FARTHEST:
            raise ValueError(f"the {piece.kind} must end at x = {_FARTHEST:g} m at most (given: {end:g})")
    for one, other in pairwise(order):
        if other.span()[0] < one.span()[1] - _EDGE:
            (low, high), (start, _) = one.span(), other.span()
            raise ValueError(
                f"the {one.kind} from {low:g} to {high:g} m and the {other.kind} from {start:g} m on are at one place"
            )
    return order
