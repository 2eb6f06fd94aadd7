"""Many runs of a scenario with its fields varied, on all cores or a cluster, and what share of them survives."""
