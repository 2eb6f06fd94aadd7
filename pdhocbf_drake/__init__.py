"""Periodic safety for walking robots: periodic discrete-time high-order control barrier functions on Drake.

These names, with the subpackages `barriers`, `estimation`, `qp` and `sets`, are all that is promised to stay
(CHANGELOG.md says how long); every other module may change. Each is loaded when it is first used, so that this import
takes no time.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from pdhocbf_drake import barriers, estimation, qp, sets
    from pdhocbf_drake.analysis.products import replay, report, write_run
    from pdhocbf_drake.errors import InputError
    from pdhocbf_drake.robot.biped import Biped as Robot
    from pdhocbf_drake.simulation.run_folder import Run, read_run
    from pdhocbf_drake.simulation.scenario import Scenario
    from pdhocbf_drake.simulation.scenario_file import load_scenario
    from pdhocbf_drake.simulation.simulate import make_diagram, simulate
    from pdhocbf_drake.simulation.walk_controller import WalkController
    from pdhocbf_drake.studies.campaign.study import campaign
    from pdhocbf_drake.studies.certify.study import certify
    from pdhocbf_drake.studies.push.study import push

__version__ = "0.2.0"

__all__ = [
    "InputError",
    "Robot",
    "Run",
    "Scenario",
    "WalkController",
    "barriers",
    "campaign",
    "certify",
    "estimation",
    "load_scenario",
    "make_diagram",
    "push",
    "qp",
    "read_run",
    "replay",
    "report",
    "sets",
    "simulate",
    "write_run",
]

# The module below this package in which each name is defined; "" is a subpackage.
_HOMES: Final[dict[str, str]] = {
    "InputError": "errors",
    "Robot": "robot.biped",
    "Run": "simulation.run_folder",
    "Scenario": "simulation.scenario",
    "WalkController": "simulation.walk_controller",
    "barriers": "",
    "campaign": "studies.campaign.study",
    "certify": "studies.certify.study",
    "estimation": "",
    "load_scenario": "simulation.scenario_file",
    "make_diagram": "simulation.simulate",
    "push": "studies.push.study",
    "qp": "",
    "read_run": "simulation.run_folder",
    "replay": "analysis.products",
    "report": "analysis.products",
    "sets": "",
    "simulate": "simulation.simulate",
    "write_run": "analysis.products",
}
_INTERNAL_NAMES: Final = {"Robot": "Biped"}


def __getattr__(name: str) -> Any:
    home = _HOMES.get(name)
    if home is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}; it offers {', '.join(__all__)}")
    if not home:
        return importlib.import_module(f"{__name__}.{name}")
    value = getattr(importlib.import_module(f"{__name__}.{home}"), _INTERNAL_NAMES.get(name, name))
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__", "__doc__", "__file__", "__name__", "__path__"])
