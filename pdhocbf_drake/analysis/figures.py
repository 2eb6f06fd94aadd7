"""All figures of a run, in the order of its report, rendered once for its report and for its folder."""

from __future__ import annotations

import gc
from collections.abc import Iterable, Iterator, Sequence
from itertools import chain, islice
from pathlib import Path
from typing import NamedTuple

from matplotlib.figure import Figure

from pdhocbf_drake.analysis import figures_estimate, figures_oscillator, figures_robot, figures_walk
from pdhocbf_drake.analysis.barrier_margins import quantities_of
from pdhocbf_drake.analysis.drawing import styled
from pdhocbf_drake.analysis.page import png
from pdhocbf_drake.analysis.plan_frame import plan_over_stance
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


def rendered(figures: Iterable[Drawn]) -> list[Picture]:
    """Each figure as a picture; those that are made one by one are freed one by one."""
    pictures = []
    for name, caption, figure in figures:
        pictures.append(Picture(name, caption, png(figure)))
        del figure
        gc.collect(0)  # a figure's parts refer to each other in circles
    return pictures


def make_figures(run: Run, limits: RobotLimits | None) -> list[Drawn]:
    """All figures of a run; none for a log of less than two rows."""
    return list(figures_of(run, limits))


def figures_of(run: Run, limits: RobotLimits | None) -> Iterator[Drawn]:
    """The same, each made when it is asked for: those of a long run take a lot of memory."""
    if len(run.log) < 2:
        return
    run = run._replace(log=plan_over_stance(run.log))
    if run.scenario.system == "van_der_pol":
        each = _oscillator(run)
    else:
        each = chain(_walk(run, limits), _robot(run, limits) if limits is not None else ())
    while True:
        with styled():
            made = list(islice(each, 1))
        if not made:
            return
        yield made.pop()  # which is then held by the one who asked alone


def write_pictures(pictures: Sequence[Picture], folder: Path) -> None:
    """Writes each picture to its file."""
    for picture in pictures:
        with replaced_file(folder / f"{picture.name}.png") as staging:
            staging.write_bytes(picture.image)


def _oscillator(run: Run) -> Iterator[Drawn]:
    yield Drawn("tubes", "States in their tubes (18)", figures_oscillator.tubes(run))
    yield Drawn("phase", "The orbit in the phase plane", figures_oscillator.phase(run))
    yield Drawn("barriers", "Barriers on the measured state", figures_walk.barriers(run))


def _walk(run: Run, limits: RobotLimits | None) -> Iterator[Drawn]:
    names = " and ".join(quantity.label for quantity in quantities_of([run.scenario]))
    yield Drawn("velocity", f"{names}, planned and measured, under the bounds", figures_walk.quantities(run))
    if run.log.time[-1] > run.scenario.from_time:
        caption = "The same over three gaits of the steady state"
        yield Drawn("velocity_steady", caption, figures_walk.quantities_steady(run))
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
