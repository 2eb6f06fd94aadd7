"""The replay page of a run: an animation with a legend, made from the log alone, that opens from disk."""

from __future__ import annotations

import html

from pdhocbf_drake.analysis import palette
from pdhocbf_drake.analysis.replay_scenes import oscillator_scene, robot_scene, rows_of, template_scene
from pdhocbf_drake.analysis.replay_stage import FRAMES_PER_SECOND, Stage
from pdhocbf_drake.errors import RunFolderError
from pdhocbf_drake.simulation.run_folder import Run

_SCENES = {"biped": robot_scene, "vhip": template_scene, "van_der_pol": oscillator_scene}


def replay_html(run: Run) -> str:
    """The replay's page, up to the first row with NaN; raises `RunFolderError` for a log of less than two such rows."""
    run = run._replace(log=run.log.finite())
    if len(run.log) < 2:
        raise RunFolderError("the run has less than two rows of finite numbers, so there is nothing to replay")
    stage = Stage()
    draw = _SCENES[run.scenario.system](stage, run)
    for row, time in rows_of(run.log, FRAMES_PER_SECOND):
        with stage.frame(time):
            draw(row, time)
    page = stage.html()
    end = page.rfind("</body>")
    return page[:end] + _legend(run) + page[end:]


def _legend(run: Run) -> str:
    """The meaning of the colours, in a corner of the page."""
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
    rows = "".join(
        f'<div><span style="display:inline-block;width:1.6em;height:.8em;margin-right:.5em;border-radius:2px;'
        f'background:{colour}"></span>{html.escape(text)}</div>'
        for colour, text in entries
    )
    style = (
        "position:fixed;left:12px;bottom:12px;padding:8px 12px;border-radius:6px;background:rgba(255,255,255,.82);"
        "font:12px/1.5 system-ui,sans-serif;color:#222;pointer-events:none"
    )
    return f'<div style="{style}"><b>{html.escape(run.scenario.name)}</b>{rows}</div>'
