"""From the description of a needle-steering task to a verified strategy and a steered needle."""
