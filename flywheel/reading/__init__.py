"""From TOML to the scene's records, every fault at once.

Uses `mechanisms`, for what a load needs to know of a stroke, and what is below it.
"""
