"""Graphs as JSON, expressions as trees, and files that are written whole or not at all."""
