"""The command line: `pdhocbf list | run | compare | replay | report`."""

from pdhocbf_drake.cli.main import main

__all__ = ["main"]
