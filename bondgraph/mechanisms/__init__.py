"""Mechanisms as graphs: planar rigid bodies and their joints, and the slider-crank that methods are compared on."""
