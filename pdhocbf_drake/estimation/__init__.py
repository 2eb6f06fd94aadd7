"""Sensors as data, and the floating base, CoM and soles estimated from them."""

from typing import TYPE_CHECKING

from pdhocbf_drake.lazy import lazy_names

if TYPE_CHECKING:
    from pdhocbf_drake.estimation.anchor import AnchorFilter
    from pdhocbf_drake.estimation.calibration import calibrated_offsets
    from pdhocbf_drake.estimation.config import SensorsConfig
    from pdhocbf_drake.estimation.contact_ekf import ContactEkf
    from pdhocbf_drake.estimation.legs import Legs
    from pdhocbf_drake.estimation.memory import Memory
    from pdhocbf_drake.estimation.sample import Estimate, Notice, Sample

__all__ = [
    "AnchorFilter",
    "ContactEkf",
    "Estimate",
    "Legs",
    "Memory",
    "Notice",
    "Sample",
    "SensorsConfig",
    "calibrated_offsets",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "anchor": ("AnchorFilter",),
        "calibration": ("calibrated_offsets",),
        "config": ("SensorsConfig",),
        "contact_ekf": ("ContactEkf",),
        "legs": ("Legs",),
        "memory": ("Memory",),
        "sample": ("Estimate", "Notice", "Sample"),
    },
)
