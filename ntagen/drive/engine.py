"""The engine's synthesiser with the margins, the ranking and the budgets of the settings."""

from __future__ import annotations

from collections.abc import Callable

from ntagen.drive.settings import Settings
from ntagen.plan.synthesise import EngineSynthesiser


def engine_for(
    settings: Settings,
    listen: Callable[[], None] = lambda: None,
    *,
    keeps_strategy: bool = False,
) -> EngineSynthesiser:
    """The synthesiser that lists plans; see `EngineSynthesiser` for the arguments."""
    return EngineSynthesiser(
        margins=settings.margins,
        ranking=settings.ranking,
        max_plans=settings.max_plans,
        timeout_s=settings.engine_time_s,
        memory_bytes=settings.engine_memory_bytes,
        keeps_strategy=keeps_strategy,
        listen=listen,
    )
