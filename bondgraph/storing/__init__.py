"""Graphs as plain data."""
