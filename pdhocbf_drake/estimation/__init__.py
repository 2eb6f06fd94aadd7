"""Sensors as data, and the floating base, CoM and soles estimated from them."""

from typing import TYPE_CHECKING

from pdhocbf_drake.lazy import lazy_names

if TYPE_CHECKING:
    from pdhocbf_drake.estimation.anchor import AnchorFilter
    from pdhocbf_drake.estimation.config import SensorsConfig
    from pdhocbf_drake.estimation.contact_ekf import ContactEkf
    from pdhocbf_drake.estimation.memory import Memory
    from pdhocbf_drake.estimation.sample import Estimate, Notice, Sample

__all__ = ["AnchorFilter", "ContactEkf", "Estimate", "Memory", "Notice", "Sample", "SensorsConfig"]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "anchor": ("AnchorFilter",),
        "config": ("SensorsConfig",),
        "contact_ekf": ("ContactEkf",),
        "memory": ("Memory",),
        "sample": ("Estimate", "Notice", "Sample"),
    },
)
