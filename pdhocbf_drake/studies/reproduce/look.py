"""One colour and one name for each case, on top of the palette that all figures share."""

from __future__ import annotations

from typing import Final

from pdhocbf_drake.analysis import palette

PERIODIC: Final = palette.CASES["P-DHOCBF"]
CONSTANT: Final = palette.CASES["DCBF"]
FREE: Final = palette.CASES["none"]
NOMINAL: Final = palette.MEASURED_COM
LIMIT: Final = palette.UNSAFE

CASE_NAMES: Final = {"periodic": "Case 2, P-DHOCBF", "constant": "Case 1, DCBF", "free": "no barrier"}
CASE_COLOURS: Final = {"periodic": PERIODIC, "constant": CONSTANT, "free": FREE}
CASE_STYLES: Final = {"periodic": "-", "constant": "--", "free": ":"}
