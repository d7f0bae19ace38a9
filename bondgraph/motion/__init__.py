"""Equations of motion in numbers: independent flows, evaluation, time stepping, power audit."""
