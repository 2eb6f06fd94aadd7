"""The periodic MPC (36): its programs, their solvers, what is done without a solution, and memory from tick to tick."""
