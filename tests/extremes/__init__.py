"""The extremes: each gives the right number, within the error it states, or is refused with a reason."""
