"""Measured traces of a needle's tip, and what the model says of them (paper, experiment 1)."""
