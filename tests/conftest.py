"""Properties are tried on the same examples in every run, and no example is timed."""

from hypothesis import settings

settings.register_profile("same", derandomize=True, deadline=None)
settings.load_profile("same")

collect_ignore = ["benchmarks"]  # programs, run by .ci/run; nothing in them is a test
