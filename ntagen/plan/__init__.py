"""Plans: strategies as pushes and rolls, certified against the continuous arc, and ranked."""
