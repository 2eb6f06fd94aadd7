"""A Meshcat scene, recorded or live: ground, sky, a view that follows, shapes that move, scale and change colour."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np
from pydrake.geometry import Meshcat, MeshcatParams, Rgba, Shape
from pydrake.math import RigidTransform, RotationMatrix

from pdhocbf_drake.analysis.palette import Rgb, rgb
from pdhocbf_drake.analysis.replay_ground import TILE, tops
from pdhocbf_drake.ground.terrain import Terrain

FRAMES_PER_SECOND = 30

_HALF_WIDTH = 2.5  # [m]
_GROUND = {
    "light": Rgba(0.93, 0.94, 0.95),
    "dark": Rgba(0.84, 0.86, 0.88),
    "walls": Rgba(0.70, 0.73, 0.76),
    "edges": Rgba(0.45, 0.48, 0.52),
}


class Stage:
    """Records one frame after another, and shows nothing meanwhile; `html` returns the page, which loads nothing.

    All paths are below one world, which moves backwards under a camera at rest, since a moving camera would keep its
    target.

    Args:
        frames_per_second: of the recording; None shows each change at once instead, in whatever browser is connected.

    Attributes:
        meshcat: Drake's recorder, for a `MeshcatVisualizer` to publish to, below `world`.
        world: path of the world in Meshcat's tree.
    """

    world = "world"

    def __init__(self, frames_per_second: float | None = FRAMES_PER_SECOND) -> None:
        self._rate = frames_per_second
        with _quiet():
            self.meshcat = Meshcat(MeshcatParams(host="localhost", show_stats_plot=False))
        self._time: float | None = None
        self._recorded: dict[tuple[str, str], tuple[float, ...]] = {}
        self.meshcat.SetProperty("/Axes", "visible", False)
        self.meshcat.SetProperty("/Grid", "visible", False)
        self.meshcat.SetProperty("/Background/<object>", "top_color", [0.80, 0.87, 0.95])
        self.meshcat.SetProperty("/Background/<object>", "bottom_color", [0.97, 0.98, 1.0])

    @contextmanager
    def frame(self, time: float) -> Iterator[None]:
        """Records the changes made inside at this time [s], which must grow from frame to frame."""
        if self._rate is None:
            raise ValueError("a stage that shows each change at once records nothing")
        if self._time is None:
            self.meshcat.StartRecording(self._rate, set_visualizations_while_recording=False)
        self._time = time
        yield

    def add(self, path: str, shape: Shape, colour: str, opacity: float = 1.0) -> None:
        """Puts a shape at a path of the scene tree."""
        self.meshcat.SetObject(self._in_world(path), shape, Rgba(*rgb(colour), opacity))

    def add_trace(self, path: str, points: np.ndarray) -> None:
        """Draws a line through points, (T, 3) [m]."""
        self.meshcat.SetLine(self._in_world(path), np.asfortranarray(points.T), 2.0)

    def through_everything(self, path: str, order: int) -> None:
        """Draws the shape at a path over all that is before it, and over such shapes of lower order."""
        shape = f"{self._in_world(path)}/<object>"
        self.meshcat.SetProperty(shape, "material.depthTest", False)
        self.meshcat.SetProperty(shape, "material.transparent", True)  # these are drawn last
        self.meshcat.SetProperty(shape, "renderOrder", 10.0 + order)

    def move(self, path: str, position: Sequence[float] | np.ndarray) -> None:
        """Moves the shapes at a path to a position [m] without turning them."""
        self.place(path, RigidTransform(np.asarray(position, dtype=float)))

    def place(self, path: str, pose: RigidTransform) -> None:
        """Moves and turns the shapes at a path."""
        self.meshcat.SetTransform(self._in_world(path), pose, self._time)

    def scale(self, path: str, factors: Sequence[float]) -> None:
        """Stretches the shapes at a path along their own axes; recorded only where that changes."""
        self._animate(self._in_world(path), "scale", tuple(max(1e-3, float(factor)) for factor in factors))

    def show(self, path: str, visible: bool) -> None:
        """Shows or hides the shapes at a path by their size, since Meshcat does not animate visibility."""
        self.scale(path, (1.0, 1.0, 1.0) if visible else (0.0, 0.0, 0.0))

    def colour(self, path: str, colour: Rgb) -> None:
        """Colours the shape at a path."""
        self._animate(f"{self._in_world(path)}/<object>", "material.color", colour)

    def aim(self, target: Sequence[float], distance: Sequence[float]) -> None:
        """Aims the camera at a target from a distance away [m]; the viewer can still turn and zoom it."""
        self.meshcat.SetCameraPose(np.add(target, distance), np.asarray(target, dtype=float))

    def follow(self, position: Sequence[float], yaw: float = 0.0) -> None:
        """Moves and turns the world so that this position [m] appears at the origin's place, and this heading along x.

        It turns about the vertical; `yaw` is in rad.
        """
        pose = RigidTransform(RotationMatrix.MakeZRotation(yaw), np.asarray(position, dtype=float))
        self.meshcat.SetTransform(self.world, pose.inverse(), self._time)

    def ground(
        self, start: float, end: float, right: float = 0.0, left: float = 0.0, terrain: Terrain | None = None
    ) -> None:
        """Lays tiled ground, else flat, under the walk from x = start to end, y = right to left [m], or just below."""
        x, y = (
            (np.floor((low - _HALF_WIDTH) / TILE) * TILE, np.ceil((high + _HALF_WIDTH) / TILE) * TILE)
            for low, high in ((start, end), (right, left))
        )
        for name, quads in tops(terrain or Terrain(), x, y).items():
            if (mesh := quads.mesh()) is not None:
                self.meshcat.SetTriangleMesh(self._in_world(f"ground/{name}"), *mesh, _GROUND[name])

    def html(self) -> str:
        """The page with the recording, playing over and over."""
        for (path, name), value in self._recorded.items():
            # Meshcat repeats what happens at each path by itself, so that all must be of the same length.
            self.meshcat.SetProperty(path, name, list(value), self._time)
        recording = self.meshcat.get_mutable_recording()
        recording.set_autoplay(True)
        recording.set_loop_mode(recording.LoopMode.kLoopRepeat)
        recording.set_repetitions(10_000)
        self.meshcat.StopRecording()
        self.meshcat.PublishRecording()
        page: str = self.meshcat.StaticHtml()
        return page

    def _in_world(self, path: str) -> str:
        return f"{self.world}/{path}"

    def _animate(self, path: str, name: str, value: tuple[float, ...]) -> None:
        """Records a step, not a ramp, since the viewer interpolates between two changes."""
        last = self._recorded.get((path, name))
        if last == value:
            return
        if self._rate is None:
            self._recorded[path, name] = value
            self._set(path, name, value)
            return
        if self._time is None:
            return
        before = self._time - 1.0 / self._rate
        if last is not None and before > 0.0:
            self.meshcat.SetProperty(path, name, list(last), before)
        self.meshcat.SetProperty(path, name, list(value), self._time)
        self._recorded[path, name] = value

    def _set(self, path: str, name: str, value: tuple[float, ...]) -> None:
        """Sets a property at once, by the name that it has outside a recording."""
        if name == "material.color":
            self.meshcat.SetProperty(path, "color", [*value, 1.0])
        else:  # not that of the place itself, which every new transform sets to 1
            self.meshcat.SetProperty(f"{path}/<object>", name, list(value))


@contextmanager
def _quiet() -> Iterator[None]:
    """Suppresses the address that Meshcat prints."""
    logger = logging.getLogger("drake")
    level = logger.level
    logger.setLevel(logging.WARNING)
    try:
        yield
    finally:
        logger.setLevel(level)
