"""A run in words: one line for each record that a person wants to read."""

from __future__ import annotations

from ntagen.drive.records import (
    Advised,
    Answered,
    CutShort,
    Ended,
    Estimated,
    Followed,
    Forgotten,
    Found,
    Guaranteed,
    Learned,
    Promised,
    Record,
    Relied,
    Synthesised,
    Transition,
    Visited,
)
from ntagen.drive.states import Event, State
from ntagen.plan.wording import counted
from ntagen.scene import Vector
from ntagen.units import deg_from_rad

_FAR_MM = 1e8
_NO_ROLL_RAD = 1e-9


def tell(record: Record) -> str | None:
    """The line for a record; None if the record is routine."""
    text = text_of(record)
    return None if text is None else f"{record.time_s:7.2f} s  {text}"


def text_of(record: Record) -> str | None:
    """What a record says, without its time; None if the record is routine."""
    match record:
        case Transition():
            return _transition(record)
        case Estimated():
            return (
                f"estimate: tip {_point(record.position_mm)} mm, radius "
                f"{record.radius_mm:.2f} ± {record.radius_std_mm:.2f} mm, "
                f"residual {record.rms_mm:.3f} mm"
            )
        case Synthesised():
            return _synthesis(record)
        case Learned() | Forgotten():
            return _region(record)
        case CutShort():
            return f"{record.reason}: stop after {record.made_mm:.2f} mm of the push"
        case Followed() | Guaranteed() | Promised():
            return of_strategy(record)
        case Relied():
            return record.text
        case Advised():
            return _advised(record)
        case Found() | Answered():
            return _resumed(record)
        case Visited():
            return f"target {record.target} reached"
        case Ended():
            return f"{record.outcome}: {record.reason}"
    return None


def _transition(record: Transition) -> str | None:
    match record.event:
        case Event.FORCE.value:
            return "the force rises: stop"
        case Event.DEVIATION.value:
            return "the tip deviates from the plan: stop"
        case Event.PLAN_FAILS.value:
            return "the rest of the plan no longer holds"
        case Event.PLAN_DONE.value:
            return "the plan is done"
    match record.following:
        case State.RETREAT.value:
            return "pull back to the entry"
        case State.INITIAL_PUSH.value:
            return "initial push"
        case State.PULL_BACK.value:
            return "pull back"
    return None


def _region(record: Learned | Forgotten) -> str:
    """A region that was learned, or is no more."""
    if isinstance(record, Forgotten):
        return f"{record.kind} region '{record.name}' is now part of a larger one"
    return (
        f"learned: {record.kind} region '{record.name}' at "
        f"{_point(record.center_mm)} mm, radius {record.radius_mm:.2f} mm"
    )


def _resumed(record: Found | Answered) -> str:
    """Where a needle was found, and what keeps the driver from going on; or what was answered."""
    if isinstance(record, Answered):
        return f"may the needle {record.question}? {'yes' if record.agrees else 'no'}"
    place = (
        f"found: {record.text}; the tip is {record.off_mm:.2f} mm off the channel "
        f"({record.allowed_mm:.2f} mm allowed)"
    )
    return f"{place}; the needle may only be pulled back: {record.lack}" if record.lack else place


def _advised(record: Advised) -> str | None:
    """What the policy changes, or why it does not decide; what goes on as planned is routine."""
    place = f"{record.depth_mm:.2f} mm deep"
    if record.by != "policy":
        said = f"the policy says {record.move}, but " if record.move else ""
        return f"{place}: {said}{record.reason}; {record.by} decides"
    if record.reason == "as planned":
        return None
    return f"{place}: the policy says {record.move}: {record.reason}"


def _synthesis(record: Synthesised) -> str:
    place = f"synthesis {record.number} from {record.depth_mm:.2f} mm deep"
    count = counted(record.found, record.accepted, is_complete=not record.partial)
    if not record.plan:
        return f"{place}: {count}"
    far = record.clearance_mm > _FAR_MM
    clearance = "" if far else f", {record.clearance_mm:.2f} mm from critical regions"
    return f"{place}: {count}; best: {record.plan}{clearance}"


def of_strategy(record: Followed | Guaranteed | Promised) -> str:
    """What a strategy against the tissue promises, sees and has held."""
    if isinstance(record, Followed):
        return _followed(record)
    return _promised(record) if isinstance(record, Promised) else guaranteed(record)


def _followed(record: Followed) -> str:
    """What the driver has seen of the tissue at the end of a branch, and what it does then."""
    tissue = f"the needle bends {record.factor:g} times as expected"
    if abs(record.roll_error_rad) > _NO_ROLL_RAD:
        error_deg = deg_from_rad(record.roll_error_rad)
        side = "too far" if error_deg > 0.0 else "not far enough"
        tissue += f", and the roll went {abs(error_deg):g} deg {side}"
    return (
        f"{record.depth_mm:.2f} mm deep: {tissue} ({record.off_mm:.2f} mm off); "
        f"so: {record.decision}"
    )


def _promised(record: Promised) -> str:
    """What a strategy wins against."""
    bounds = [f"bends within {100.0 * record.curvature_ratio:.3g} % of the estimate"]
    if record.roll_rad > 0.0:
        bounds.append(f"rolls within {deg_from_rad(record.roll_rad):.3g} deg of the command")
    return (
        f"{record.depth_mm:.2f} mm deep: a strategy with {record.branches} branches is guaranteed "
        f"to reach the target while the needle {', '.join(bounds)}, and is at most "
        f"{record.tip_mm:.2f} mm off for other reasons; all this with a confidence of "
        f"{record.confidence:g}"
    )


def guaranteed(record: Guaranteed) -> str:
    """How long the guarantee of a strategy held."""
    off = (
        f"the tip was at most {record.most_off_mm:.3f} mm off ({record.allowed_mm:.3g} mm allowed)"
    )
    if not record.reason:
        return f"the guarantee held up to the target: {off}"
    return (
        f"the guarantee ends here: {record.reason}; it held up to a depth of "
        f"{record.until_mm:.2f} mm: {off}"
    )


def _point(position_mm: Vector) -> str:
    # Adding zero turns a rounded -0.00 into 0.00.
    return "(" + ", ".join(f"{round(c, 2) + 0.0:.2f}" for c in position_mm) + ")"
