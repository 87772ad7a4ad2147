"""Games with known best values, for learning and optimisation queries."""
