"""What a run decided, in time order: its events, and every synthesis with its best plan."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

from ntagen.drive.reading import RunLog
from ntagen.drive.records import (
    Advised,
    Answered,
    Command,
    CutShort,
    Ended,
    Estimated,
    Followed,
    Foreseen,
    Forgotten,
    Found,
    Guaranteed,
    Learned,
    Measured,
    Promised,
    Record,
    Relied,
    Synthesised,
    Timed,
    Transition,
    Visited,
)
from ntagen.drive.states import ABORTS, Event
from ntagen.drive.story import text_of
from ntagen.errors import InputError
from ntagen.files import json_of
from ntagen.units import deg_from_rad

_NO_REGION_MM: Final = 1e9
_ALMOST_SURE: Final = 0.9999

_KINDS: Final[dict[type[Record], str]] = {
    Relied: "relied on",
    Estimated: "estimate",
    Synthesised: "synthesis",
    Learned: "learned",
    Forgotten: "forgotten",
    CutShort: "cut short",
    Found: "found",
    Answered: "answer",
    Followed: "strategy",
    Guaranteed: "guarantee",
    Promised: "guarantee",
    Advised: "advice",
    Visited: "target",
    Foreseen: "foreseen",
    Ended: "end",
}
"""What each kind of record is in the table of events."""

_ALARMS: Final = frozenset({Event.FORCE.value, Event.DEVIATION.value})
_ABORTED: Final = frozenset(event.value for event in ABORTS)
_ROUTINE: Final = frozenset(
    event.value
    for event in (
        Event.ARMED,
        Event.PUSHED,
        Event.ESTIMATED,
        Event.IN_TARGET,
        Event.FIRST_STRATEGY,
        Event.STRATEGY_FOUND,
        Event.ACTED,
        Event.AS_PREDICTED,
        Event.STOPPED,
        Event.PULLED,
        Event.GOES_ON,
        Event.ONLY_BACK,
        Event.IS_OUT,
    )
)
"""Events of the state machine that need no line of their own."""

_DONE: Final = {"pull": "pull back", "wait": "hold", "stop": "stopped", "roll": "roll"}
"""The commands that are told; pushes are too many, and the curve of the depth shows them."""


def events_of(log: RunLog) -> list[dict[str, Any]]:
    """All that was decided or came from outside, in order: time, depth, kind and words.

    Among them are what the driver relied on, estimates, syntheses, rolls, stops, holds, pulls,
    learned and forgotten regions, advice of a policy, aborts, and the end.
    """
    events, depth_mm, force_n = [], 0.0, 0.0
    for record in log.records:
        if isinstance(record, Measured):
            depth_mm, force_n = record.depth_mm, record.force_n
            continue
        told = _event(record, force_n)
        if told is not None:
            kind, text = told
            row = {"time_s": record.time_s, "depth_mm": depth_mm, "kind": kind, "text": text}
            events.append(row)
    return events


def _event(record: Record, force_n: float) -> tuple[str, str] | None:
    """The kind and the words of a record; None if it is routine."""
    if isinstance(record, Command):
        return _command(record)
    if isinstance(record, Transition):
        return _transition(record, force_n)
    text = text_of(record)
    if isinstance(record, Foreseen):
        text = _foreseen(record)
    elif isinstance(record, Advised) and text is None:
        text = f"{record.depth_mm:.2f} mm deep: the policy says {record.move}: {record.reason}"
    return None if text is None else (_KINDS[type(record)], text)


def _command(record: Command) -> tuple[str, str] | None:
    match record.kind:
        case "pull":
            text = f"the needle is pulled back by {record.value:.2f} mm"
        case "wait":
            text = f"the needle is held for {record.value:.2f} s"
        case "roll":
            text = f"the needle is rolled by {deg_from_rad(record.value):.4g} deg"
        case "stop":
            text = "the needle is stopped"
        case _:
            return None
    return _DONE[record.kind], text


def _transition(record: Transition, force_n: float) -> tuple[str, str] | None:
    """Why the state changed, where that is no routine."""
    text = text_of(record)
    if record.event in _ABORTED:
        return "abort", f"{record.event} in the state '{record.state}'"
    if record.event == Event.FORCE.value:
        return "stop", f"{text} (the last reading is {force_n:.3g} N)"
    if record.event in _ALARMS:
        return "stop", text or record.event
    if text is None and record.event in _ROUTINE:
        return None
    return "decision", text or record.event


def _foreseen(record: Foreseen) -> str:
    far_mm = record.length_mm[-1] if record.length_mm else 0.0
    widest_mm = max(record.std_mm, default=0.0)
    return (
        f"in the next {far_mm:.2f} mm, no known critical region is touched with a confidence of "
        f"{chance_text(record.confidence)}; the tip is then known to {widest_mm:.2f} mm"
    )


def chance_text(value: float) -> str:
    """A probability with four digits; one below 1 is never rounded up to it, nor one to 0."""
    if _ALMOST_SURE < value < 1.0:
        return f"more than {_ALMOST_SURE}"
    if 0.0 < value < 1.0 - _ALMOST_SURE:
        return f"less than {1.0 - _ALMOST_SURE:.4f}"
    return f"{value:.4f}" if 0.0 < value < 1.0 else f"{value:g}"


def syntheses_of(log: RunLog) -> list[dict[str, Any]]:
    """Every synthesis: when, from where, how many plans, the chosen one, margins, confidence, time.

    Raises:
        InputError: The log has plans that cannot be read.
    """
    rows: list[dict[str, Any]] = []
    for record in log.records:
        if isinstance(record, Synthesised):
            rows.append(_synthesis(record, log))
        elif isinstance(record, Timed) and rows:
            rows[-1] |= {"engine_s": record.seconds, "whole_s": record.loop_seconds}
        elif isinstance(record, Foreseen) and rows and rows[-1]["confidence"] is None:
            rows[-1]["confidence"] = record.confidence
    return rows


def _synthesis(record: Synthesised, log: RunLog) -> dict[str, Any]:
    has_plan = bool(record.plan)
    far = record.clearance_mm >= _NO_REGION_MM
    return {
        "number": record.number,
        "time_s": record.time_s,
        "from_depth_mm": record.depth_mm,
        "found": record.found,
        "hold": record.accepted,
        "all_listed": not record.partial,
        "plan": record.plan or None,
        "clearance_mm": record.clearance_mm if has_plan and not far else None,
        **_best(record.number, log),
        "confidence": None,
        "engine_s": None,
        "whole_s": None,
        "model_sha256": record.model_sha256,
    }


def _best(number: int, log: RunLog) -> dict[str, Any]:
    """What the attached plans of a synthesis say of the best one, and of the margins."""
    name = f"rebuild-{number:04d}/plans.json"
    found: dict[str, Any] = {"ranking": None, "margins": None, "length_mm": None, "rolls": None}
    found |= {"target_depth_mm": None, "detection_clearance_mm": None}
    if name not in log.attachments:
        return found
    document = plans_in(log, name)
    found |= {"ranking": document["ranking"], "margins": document["margins"]}
    if not document["plans"]:
        return found
    try:
        best = document["plans"][0]["certificate"]
        depths = [target["depth_mm"] for target in best["targets"]]
        return found | {
            "length_mm": best["length_mm"],
            "rolls": best["rolls"],
            "target_depth_mm": depths[-1] if depths else None,
            "detection_clearance_mm": best["detection_clearance_mm"],
        }
    except (KeyError, TypeError) as error:
        raise _unreadable(log, name, error) from error


def plans_in(log: RunLog, name: str) -> dict[str, Any]:
    """The document of plans in an attachment; `ntagen.plan.document` says what is in it.

    Raises:
        InputError: It is no such document.
    """
    try:
        document = json_of(log.attachments[name])
        parts = {part: document[part] for part in ("ranking", "margins", "plans")}
        if not isinstance(parts["plans"], list) or not isinstance(parts["margins"], dict):
            raise TypeError("its parts are of another kind")
    except (KeyError, TypeError, ValueError, RecursionError) as error:
        raise _unreadable(log, name, error) from error
    return parts


def _unreadable(log: RunLog, name: str, error: Exception) -> InputError:
    return InputError(f"{log.path}: the plans in {name} cannot be read: {error!r}")


def alarm_times_s(log: RunLog) -> Iterator[float]:
    """When the needle was stopped by an alarm, an abort, or in the middle of a push, in s."""
    for record in log.records:
        is_alarm = isinstance(record, Transition) and record.event in _ALARMS | _ABORTED
        if is_alarm or isinstance(record, CutShort):
            yield record.time_s
