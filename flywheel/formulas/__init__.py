"""Expressions: text to checked trees, and their values as numbers, derivatives, and proven bounds."""
