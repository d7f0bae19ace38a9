"""Methods compared on one scene, against a verified reference; uses `motion` and the folders below it."""
