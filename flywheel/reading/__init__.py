"""Reading of scenes: every table checked against the format, every fault with its place."""
