"""Scene files, expressions and tables mutated by the thousand: a result, or faults; never a traceback, never a hang.

`python -m tests.fuzzing --count 10000 --seed 1 --jobs 1` runs it; `--only SEED` shows and tries a single mutant.
"""
