"""Measures what a control tick costs, against other ways to solve the same problem: `pdhocbf bench`."""
