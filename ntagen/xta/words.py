"""The words of UPPAAL's languages: which are reserved, and the functions that are built in.

Source: the tables of the engine, `checker/src/syntax/keywords.rs` and `checker/src/builtins`; the
tests ask the engine about each word.
"""

from __future__ import annotations

import re
from typing import Final


def _words(text: str) -> frozenset[str]:
    return frozenset(re.findall(r"\S+", text))


_BOTH: Final = _words(
    """
    system true false and or not imply int scalar location forall exists sum xor
    """
)
_MODEL_ONLY: Final = _words(
    """
    const guard sync assign probability process state branchpoint init trans urgent commit broadcast
    priority bool double chan clock void select for while do if else default return typedef struct
    import meta before_update after_update progress gantt assert IO string hybrid dynamic spawn exit
    query
    """
)
_QUERY_ONLY: Final = _words(
    """
    deadlock control control_t minE maxE minPr maxPr loadStrategy saveStrategy under imitate
    strategy simulate sat Pmax Pr numOf foreach
    """
)

MODEL_WORDS: Final = _BOTH | _MODEL_ONLY
"""Words that no name of a model may be."""

QUERY_WORDS: Final = _BOTH | _QUERY_ONLY
"""Words that cannot be a name in a query."""

FUNCTIONS: Final = _words(
    """
    abs fabs exp exp2 expm1 ln log log10 log2 log1p sqrt cbrt sin cos tan asin acos atan sinh cosh
    tanh asinh acosh atanh erf erfc tgamma lgamma ceil floor trunc round logb ilogb fmod fmax fmin
    fdim pow hypot atan2 nextafter copysign ldexp fma isfinite isinf isnan isnormal signbit
    isunordered fint random random_normal random_poisson random_arcsine random_beta random_gamma
    random_tri random_weibull
    """
)
"""The functions that need no declaration."""

_NAME: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


def is_name(text: str) -> bool:
    """Whether a text can be a name in a model and in queries about it."""
    return _NAME.fullmatch(text) is not None and text not in MODEL_WORDS | QUERY_WORDS
