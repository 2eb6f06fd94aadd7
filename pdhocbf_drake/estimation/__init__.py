"""Sensors as data, and the floating base, CoM and soles estimated from them."""
