"""The report of a run, as evidence for a lab notebook: its facts, its checks, and its page."""
