"""All figures of a run, in the order of its report, rendered once for its report and for its folder."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from matplotlib.figure import Figure

from pdhocbf_drake.analysis import figures_estimate, figures_oscillator, figures_robot, figures_walk
from pdhocbf_drake.analysis.barrier_margins import quantities_of
from pdhocbf_drake.analysis.drawing import styled
from pdhocbf_drake.analysis.page import png
from pdhocbf_drake.analysis.robot_limits import RobotLimits
from pdhocbf_drake.files.file import replaced_file
from pdhocbf_drake.simulation.run_folder import Run


class Drawn(NamedTuple):
    """A figure with its file name (without `.png`) and its caption."""

    name: str
    caption: str
    figure: Figure


class Picture(NamedTuple):
    """The same, rendered: `image` is a PNG. Rendered once more, a figure may get another layout."""

    name: str
    caption: str
    image: bytes


def rendered(figures: Sequence[Drawn]) -> list[Picture]:
    """Each figure as a picture."""
    return [Picture(drawn.name, drawn.caption, png(drawn.figure)) for drawn in figures]


def make_figures(run: Run, limits: RobotLimits | None) -> list[Drawn]:
    """All figures of a run; none for a log of less than two rows."""
    if len(run.log) < 2:
        return []
    with styled():
        if run.scenario.system == "van_der_pol":
            return [
                Drawn("tubes", "States in their tubes (18)", figures_oscillator.tubes(run)),
                Drawn("phase", "The orbit in the phase plane", figures_oscillator.phase(run)),
                Drawn("barriers", "Barriers on the measured state", figures_walk.barriers(run)),
            ]
        return [*_walk(run, limits), *(_robot(run, limits) if limits is not None else ())]


def write_pictures(pictures: Sequence[Picture], folder: Path) -> None:
    """Writes each picture to its file."""
    for picture in pictures:
        with replaced_file(folder / f"{picture.name}.png") as staging:
            staging.write_bytes(picture.image)


def _walk(run: Run, limits: RobotLimits | None) -> Iterator[Drawn]:
    names = " and ".join(quantity.label for quantity in quantities_of([run.scenario]))
    yield Drawn("velocity", f"{names}, planned and measured, under the bounds", figures_walk.quantities(run))
    if run.log.time[-1] > run.scenario.from_time:
        steady = figures_walk.quantities_steady(run)
        yield Drawn("velocity_steady", "The same over three gaits of the steady state", steady)
    if run.scenario.barriers:
        yield Drawn("barriers", "Barriers on the measured state", figures_walk.barriers(run))
    yield Drawn("com_zmp", "CoM and ZMP, planned and measured", figures_walk.com_and_zmp(run))
    yield Drawn("footsteps", "Footholds from above", figures_walk.footsteps(run, limits))
    yield Drawn("solver", "Cost of the controller's ticks", figures_walk.solver(run))


def _robot(run: Run, limits: RobotLimits) -> Iterator[Drawn]:
    yield Drawn("tracking", "Tracking errors and ZMP margin", figures_robot.tracking(run, limits))
    if "lip_estimate" in run.log:
        yield Drawn("estimate", "Estimate from the sensors, and its errors within 2σ", figures_estimate.estimate(run))
    yield Drawn("joints", "Joint angles", figures_robot.joints(run))
    yield Drawn("torques", "Torques", figures_robot.torques(run, limits))
