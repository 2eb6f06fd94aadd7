"""Periodic safety for walking robots: periodic discrete-time high-order control barrier functions on Drake."""

__version__ = "0.1.0"
