"""What delay, noise and model errors cost a walk, beside what it must reach."""
