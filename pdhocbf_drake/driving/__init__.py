"""Walks that are driven live: controls in a browser, the walk in real time, and what was pressed as a scenario."""
