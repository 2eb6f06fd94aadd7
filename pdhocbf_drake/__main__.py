"""`python -m pdhocbf_drake VERB`, and `pdhocbf VERB`: the command as a process of its own."""

from __future__ import annotations

import sys
from typing import Final

from pdhocbf_drake.allocation import begin_again_roomy

_SIMULATE: Final = {
    "run", "drive", "bench", "gait", "tune", "worth", "push", "directions", "ground", "sensing", "limits", "reproduce",
    "campaign",
}  # fmt: skip


def start() -> int:
    """`cli.main`; verbs that simulate have a process with a roomy cache."""
    if _SIMULATE.intersection(sys.argv[1:2]):
        begin_again_roomy()
    from pdhocbf_drake.cli import main  # not before, since this process may begin again

    return main()


if __name__ == "__main__":
    sys.exit(start())
