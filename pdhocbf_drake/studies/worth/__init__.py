"""The effect of barriers on disturbed walks: `pdhocbf worth`."""
