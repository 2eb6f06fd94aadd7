"""The use of barriers when something goes wrong: `pdhocbf worth`."""
