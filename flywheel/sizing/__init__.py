"""From a scene to the flywheel with its errors, its confirmation, drive and wheel.

Uses `regime` and the folders below it.
"""
