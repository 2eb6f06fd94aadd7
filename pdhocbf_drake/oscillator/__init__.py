"""The Van der Pol oscillator of the paper's first example, and the tube that holds it."""
