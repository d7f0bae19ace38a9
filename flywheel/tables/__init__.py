"""Results as text, CSV and JSON, a file for each command's subject; uses all but `pictures` and `cli`."""
