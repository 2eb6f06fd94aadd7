"""Certified sets of the walking template: what can be kept for ever, what a bound costs, what a push may do."""
