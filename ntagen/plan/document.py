"""Plans as JSON: a versioned document that other programs can read."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import asdict
from functools import lru_cache
from typing import Any, Final

from ntagen.errors import InputError
from ntagen.plan.actions import Action, Plan, Push, Roll, Wait
from ntagen.plan.certify import Certificate
from ntagen.plan.rank import DEFAULT_RANKING, Candidate
from ntagen.plan.synthesise import Margins
from ntagen.scene import Scene
from ntagen.units import deg_from_rad, rad_from_deg

FORMAT: Final = "ntagen-plans"
VERSION: Final = 1

_MARGINS: Final = Margins()


def document(
    scene: Scene,
    candidates: Sequence[Candidate],
    ranking: Sequence[str] = DEFAULT_RANKING,
    margins: Margins = _MARGINS,
) -> dict[str, Any]:
    """The plans of a scene, best first, with their certificates; in mm and degrees.

    ``holds`` says of each plan whether it holds in exact kinematics, with the margins.
    """
    return {
        "format": FORMAT,
        "version": VERSION,
        "scene": scene.name,
        "ranking": list(ranking),
        "margins": asdict(margins),
        "plans": [
            plan_document(candidate, margins, place)
            for place, candidate in enumerate(candidates, start=1)
        ],
    }


def plan_document(
    candidate: Candidate, margins: Margins, rank: int | None = None
) -> dict[str, Any]:
    """A plan with its certificate; the rank is null in lists that are not ranked."""
    return {
        "rank": rank,
        "holds": margins.allow(candidate.certificate),
        "actions": plan_to_json(candidate.plan),
        "certificate": _certificate(candidate.certificate),
    }


def plan_line(candidate: Candidate, margins: Margins) -> str:
    """`plan_document` as JSON text on one line: the same text as of `json.dumps`, sooner."""
    certificate = candidate.certificate
    x, y, z = certificate.end_mm
    clearances = ", ".join(
        f'{{"region": {_quoted(c.region)}, "kind": "{c.kind}", '
        f'"distance_mm": {_text(c.distance_mm)}, "at_mm": {_text(c.at_mm)}}}'
        for c in certificate.clearances
    )
    targets = ", ".join(
        f'{{"region": {_quoted(a.region)}, "entered_at_mm": {_text(a.entered_at_mm)}'
        f', "depth_mm": {_text(a.depth_mm)}}}'
        for a in certificate.arrivals
    )
    holds = "true" if margins.allow(certificate) else "false"
    actions = ", ".join(map(_action_text, candidate.plan.actions))
    return (
        f'{{"rank": null, "holds": {holds}, "actions": [{actions}], "certificate": '
        f'{{"length_mm": {_text(certificate.length_mm)}, "rolls": {certificate.roll_count}, '
        f'"end_mm": [{_text(x)}, {_text(y)}, {_text(z)}], '
        f'"end_distance_mm": {_text(certificate.end_distance_mm)}, '
        f'"critical_clearance_mm": {_text(_finite(certificate.critical_clearance_mm))}, '
        f'"detection_clearance_mm": {_text(_finite(certificate.detection_clearance_mm))}, '
        f'"clearances": [{clearances}], "targets": [{targets}]}}}}'
    )


def _text(number: float | None) -> str:
    """A number as `json.dumps` writes it."""
    return float.__repr__(number) if isinstance(number, float) else json.dumps(number)


@lru_cache(maxsize=4096)
def _quoted(name: str) -> str:
    return json.dumps(name)


@lru_cache(maxsize=4096)
def _action_text(action: Action) -> str:
    return json.dumps(_action_to_json(action))


def plan_to_json(plan: Plan) -> list[dict[str, float]]:
    """The actions as objects ``{"push_mm": …}``, ``{"roll_deg": …}`` and ``{"wait_s": …}``.

    A push in which the needle spins has the part as ``spin``, too.
    """
    return [_action_to_json(action) for action in plan.actions]


def plan_from_json(actions: object) -> Plan:
    """The plan of such objects.

    Raises:
        InputError: The objects are not a plan.
    """
    if not isinstance(actions, list):
        raise InputError("a plan is a list of actions")
    try:
        return Plan.of(_action_from_json(action) for action in actions)
    except ValueError as error:
        raise InputError(str(error)) from error


def _action_to_json(action: Action) -> dict[str, float]:
    if isinstance(action, Push):
        spin = {"spin": action.spin} if action.spin else {}
        return {"push_mm": action.length_mm, **spin}
    if isinstance(action, Wait):
        return {"wait_s": action.seconds}
    return {"roll_deg": round(deg_from_rad(action.angle_rad), 9)}


def _action_from_json(action: object) -> Action:
    match action:
        case {"push_mm": float() | int() as length_mm, **rest} if isinstance(
            spin := rest.get("spin", 0.0), float | int
        ):
            return Push(float(length_mm), float(spin))
        case {"roll_deg": float() | int() as angle_deg}:
            return Roll(rad_from_deg(float(angle_deg)))
        case {"wait_s": float() | int() as seconds}:
            return Wait(float(seconds))
        case _:
            raise InputError(f"unknown action {action!r}\nhint: use push_mm, roll_deg or wait_s")


def _certificate(certificate: Certificate) -> dict[str, Any]:
    return {
        "length_mm": certificate.length_mm,
        "rolls": certificate.roll_count,
        "end_mm": list(certificate.end_mm),
        "end_distance_mm": certificate.end_distance_mm,
        "critical_clearance_mm": _finite(certificate.critical_clearance_mm),
        "detection_clearance_mm": _finite(certificate.detection_clearance_mm),
        "clearances": [
            {
                "region": c.region,
                "kind": c.kind,
                "distance_mm": c.distance_mm,
                "at_mm": c.at_mm,
            }
            for c in certificate.clearances
        ],
        "targets": [
            {"region": a.region, "entered_at_mm": a.entered_at_mm, "depth_mm": a.depth_mm}
            for a in certificate.arrivals
        ],
    }


def _finite(number: float) -> float | None:
    """The number, or None if it is infinite, which JSON cannot express."""
    return number if math.isfinite(number) else None
