"""Loads of machines of known kinds: what each does as a formula, and compiled to an expression of phi, omega, x and v.

A force or torque is positive along the positive sense of its place; what resists the motion is negative while v > 0.
"""
