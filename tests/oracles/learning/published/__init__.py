"""Cases that others published, written afresh, with their numbers."""
