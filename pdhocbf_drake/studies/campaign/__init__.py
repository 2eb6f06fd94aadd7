"""Many runs of a scenario with varied fields, on all cores or a cluster, and the share of them that survive."""
