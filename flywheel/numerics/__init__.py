"""Numbers, expressions and their enclosures, cells of Chebyshev series, faults.

It is independent of machines, and uses nothing of this package.
"""
