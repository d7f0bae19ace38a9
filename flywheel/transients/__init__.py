"""Run-up, run-down, load step and stall: a machine followed in time, and what is to be told of it."""
