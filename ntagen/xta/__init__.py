"""The textual form of UPPAAL models (``.xta``, ``.ta``): its words, its tokens, its layout.

What a model means, the engine knows; nothing here parses.
"""

from __future__ import annotations

from ntagen.xta.layout import format_model
from ntagen.xta.tokens import Token, tokenise
from ntagen.xta.words import FUNCTIONS, MODEL_WORDS, QUERY_WORDS, is_name

__all__ = [
    "FUNCTIONS",
    "MODEL_WORDS",
    "QUERY_WORDS",
    "Token",
    "format_model",
    "is_name",
    "tokenise",
]
