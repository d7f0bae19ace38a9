"""Simplification: the rules, zero-velocity junctions, and the seven-step procedure that ends with them."""
