"""Equations of motion in SymPy."""
