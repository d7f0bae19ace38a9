"""Results as text, CSV and JSON; uses all but `pictures` and `cli`."""
