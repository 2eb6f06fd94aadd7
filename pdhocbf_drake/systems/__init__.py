"""The blocks of the diagram: ports, state and events around the mathematics of the other rooms."""
