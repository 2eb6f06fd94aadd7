"""The replay page of a run: an animation with a legend, made from the log alone, that opens from disk."""

from __future__ import annotations

import html

from pdhocbf_drake.analysis import palette
from pdhocbf_drake.analysis.plan_frame import plan_over_stance
from pdhocbf_drake.analysis.pushes import spans_of
from pdhocbf_drake.analysis.replay_scenes import oscillator_scene, robot_scene, rows_of, template_scene
from pdhocbf_drake.analysis.replay_stage import FRAMES_PER_SECOND, Stage
from pdhocbf_drake.analysis.replay_strip import HEIGHT, strip
from pdhocbf_drake.analysis.titles import title_of
from pdhocbf_drake.errors import RunFolderError
from pdhocbf_drake.simulation.run_folder import Run

_TRIAL = 60  # frames of a page whose size shows what a frame costs
_MANY = 600  # frames that need no trial
# Meshcat folds its panel, in which play, pause, time and pace are; a small window needs its place for the scene.
_CONTROLS = "<script>if (innerWidth >= 800) { viewer.gui.open(); viewer.gui.__folders.Scene.close() }</script>"
_SCENES = {"biped": robot_scene, "vhip": template_scene, "van_der_pol": oscillator_scene}


def replay_html(run: Run, largest: float = 25e6) -> str:
    """The replay's page, up to the first row with NaN.

    It has 30 frames a second, or so few that it is not larger than `largest` [bytes].

    Raises:
        RunFolderError: the log has less than two rows without NaN.
    """
    run = run._replace(log=plan_over_stance(run.log.finite()))
    if len(run.log) < 2:
        raise RunFolderError("the run has less than two rows of finite numbers, so there is nothing to replay")
    seconds, below = float(run.log.time[-1] - run.log.time[0]), strip(run)
    largest, rate = largest - len(below), float(FRAMES_PER_SECOND)
    if seconds * rate > _MANY:
        rate = min(rate, _affordable_frames(run, largest) / seconds)
    page = _page(run, rate)
    while len(page) > largest and rate > 1.0 / seconds:  # what appears late in the run costs more than the trial
        rate *= 0.9 * largest / len(page)
        page = _page(run, rate)
    end = page.rfind("</body>")
    return page[:end] + _legend(run, rate) + below + _CONTROLS + page[end:]


def _page(run: Run, rate: float) -> str:
    """The page without its legend, with `rate` frames a second."""
    stage = Stage(rate)
    draw = _SCENES[run.scenario.system](stage, run)
    for row, time in rows_of(run.log, rate):
        with stage.frame(time):
            draw(row, time)
    return stage.html()


def _affordable_frames(run: Run, largest: float) -> float:
    """The frames of a page of this size [bytes], by two pages of few frames."""
    seconds = float(run.log.time[-1] - run.log.time[0])
    sizes = [len(_page(run, frames / seconds)) for frames in (_TRIAL, 2 * _TRIAL)]
    return max(_TRIAL, 0.95 * (largest - sizes[0]) * _TRIAL / max(1, sizes[1] - sizes[0]))


def _legend(run: Run, rate: float) -> str:
    """The meaning of the colours, in a corner of the page, and how many frames there are if these are few."""
    oscillator = run.scenario.system == "van_der_pol"
    body = "state" if oscillator else "CoM"
    if run.scenario.barriers or oscillator:
        blend = f"linear-gradient(90deg,{palette.SAFE},{palette.UNSAFE})"
        entries = [(blend, f"{body}: green as safe as usual, red at h = 0")]
    else:
        entries = [(palette.MEASURED_COM, f"{body} (no barrier)")]
    if oscillator:
        entries += [(palette.BARRIERS[0], "tube at this tick")]
    else:
        entries += [
            (palette.PLANNED_COM, "CoM planned"),
            (palette.MEASURED_ZMP, "ZMP measured"),
            (palette.PLANNED_ZMP, "ZMP planned"),
            (palette.BARRIERS[0], "ZMP box"),
            (palette.LEFT, "left foothold taken"),
            (palette.RIGHT, "right foothold taken"),
            (palette.LIMIT, "footholds planned (frames)"),
        ]
    if spans_of(run):
        entries.append((palette.PUSH, "push, in the strip below"))
    rows = "".join(
        f'<div><span style="display:inline-block;width:1.6em;height:.8em;margin-right:.5em;border-radius:2px;'
        f'background:{colour}"></span>{html.escape(text)}</div>'
        for colour, text in entries
    )
    if rate < FRAMES_PER_SECOND:
        rows += f"<div>{rate:.2g} frames a second, since the run is long</div>"
    style = (
        f"position:fixed;left:12px;bottom:{HEIGHT + 12}px;padding:8px 12px;border-radius:6px;"
        "background:rgba(255,255,255,.82);font:12px/1.5 system-ui,sans-serif;color:#222"
    )
    name = html.escape(title_of(run.scenario))
    return f'<details id="legend" open style="{style}"><summary><b>{name}</b></summary>{rows}</details>'
