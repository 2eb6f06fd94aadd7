"""The command line, `pdhocbf VERB`, and its verbs on scenarios and runs."""

from pdhocbf_drake.cli.main import main

__all__ = ["main"]
