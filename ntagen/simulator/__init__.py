"""A simulation of a model for a page: a walk with its history, step by step, in its own process."""
