"""Hybrid models for which others have made shields, written afresh."""
