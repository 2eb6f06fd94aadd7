"""The largest push that the robot survives, with and without barriers: `pdhocbf push`."""
