"""`python -m pdhocbf_drake VERB`: the command `pdhocbf`, where that is not on the PATH."""

import sys

from pdhocbf_drake.cli import main

if __name__ == "__main__":
    sys.exit(main())
