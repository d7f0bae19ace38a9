"""Methods compared and results explained; uses `motion` and what is below it."""
