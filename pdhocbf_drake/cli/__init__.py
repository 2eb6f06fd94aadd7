"""The command line: `pdhocbf VERB`, with the verbs of `pdhocbf_drake.cli.main`."""

from pdhocbf_drake.cli.main import main

__all__ = ["main"]
