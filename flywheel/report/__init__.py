"""The worked report of a scene: every step as formula, substitution and result, as one HTML file or PDF."""
