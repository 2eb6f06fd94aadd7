"""Ground that is not flat: its pieces as data, height, slope and friction at a place, and the bodies of the plant."""
