"""Mutants of a model: small mistakes put into it, and which queries and tests notice them.

The operators are those of B. K. Aichernig, F. Lorber and D. Ničković, "Time for Mutants:
Model-Based Mutation Testing with Timed Automata" (Tests and Proofs, 2013), with two more;
`OPERATORS` says what each does.
"""

from ntagen.mutation.killing import Judge, Judged
from ntagen.mutation.operators import OPERATORS, Mutant, mutants

__all__ = ["OPERATORS", "Judge", "Judged", "Mutant", "mutants"]
