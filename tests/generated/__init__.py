"""Scenes drawn over the whole schema, tables crossed with one another, and what an independent oracle says of each."""
