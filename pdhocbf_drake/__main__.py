"""`python -m pdhocbf_drake VERB`, and `pdhocbf VERB`: the command as a process of its own."""

from __future__ import annotations

import sys
from typing import Final

from pdhocbf_drake.allocation import begin_again_roomy

_SIMULATE_ONCE: Final = {"run", "drive"}


def start() -> int:
    """`cli.main`; a verb that simulates one walk has a process with a roomy cache, see `allocation`."""
    if _SIMULATE_ONCE.intersection(sys.argv[1:2]):
        begin_again_roomy()
    from pdhocbf_drake.cli import main  # not before, since this process may begin again

    return main()


if __name__ == "__main__":
    sys.exit(start())
