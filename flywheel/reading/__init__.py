"""From TOML to the scene's records, every fault at once.

Uses `mechanisms`, for the stroke of a load's place, and the folders below it.
"""
