"""What holding the rise over a plan's horizon costs: errors of the next speed, on the template, whose eta is exact."""

from __future__ import annotations

from typing import Final

import numpy as np

from pdhocbf_drake.simulation.build import build_walk
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import advance, make_diagram
from pdhocbf_drake.studies.shared.checks import Outcome, least, most
from pdhocbf_drake.studies.shared.row_kinds import Asked
from pdhocbf_drake.studies.shared.work import Work

ROW: Final = "held rise"
_RISES = 0.05, 0.08, -0.08
_TEXT = (
    "{{duration: 7.0, gait: {{com_height: 0.55, stride: 0.25, ticks_per_step: 40}}, mpc: {{horizon: 80}}, "
    "ground: [{{kind: stairs, at: 1.0, rise: {rise}, tread: 0.25, count: 6}}]}}"
)
_LARGEST = 1.0  # error of the next speed [mm/s]


def plan(row: str, asked: Asked) -> list[Work]:
    """A walk of the template up or down stairs of each rise."""
    return [Work(row, asked.scenario, {"rise": rise}) for rise in _RISES]


def measure(work: Work) -> Outcome:
    """Largest error of the speed that is predicted for the next tick, where the rise is even and where it is not."""
    scenario = load_scenario("vhip", _TEXT.format(rise=work.setting["rise"]))
    walk = build_walk(scenario)
    log = advance(scenario, make_diagram(scenario, walk=walk))
    error = 1e3 * np.abs(log.element("lip_state", "vx") - log.element("com_reference", "vx"))
    even = np.array([walk.gait.rise(int(step)) != 0.0 for step in log.element("gait_phase", "step")])
    h = 1e3 * float(log["h"].min()) if log.ending == "finished" else None
    return Outcome(
        [
            most(ROW, "error of the next speed, even rise", float(error[even].max()), _LARGEST, "mm/s"),
            most(ROW, "error of the next speed elsewhere", float(error[~even].max()), _LARGEST, "mm/s"),
            least(ROW, "h of forward_speed", h, 0.0, "mm/s"),
        ],
        [],
    )
