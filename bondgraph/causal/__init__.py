"""Causality: which end of a bond decides what, and the equations that follow bond by bond."""
