"""Methods compared on one scene, against a verified reference; uses `motion` and what is below it."""
