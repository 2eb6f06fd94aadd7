"""Measures the time of a control tick, beside other ways to solve the same problem: `pdhocbf bench`."""
