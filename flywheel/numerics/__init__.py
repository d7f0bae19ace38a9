"""Numbers, expressions and their enclosures, cells of Chebyshev series, faults.

Knows nothing of machines, and uses nothing of this package.
"""
