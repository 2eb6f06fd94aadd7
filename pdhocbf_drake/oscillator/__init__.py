"""The Van der Pol oscillator of the paper's first example, and the periodic tube that bounds its state."""
