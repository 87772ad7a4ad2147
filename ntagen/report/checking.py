"""Checks a run again: its decisions, and each synthesis by what shares no code with the engine.

The decisions are repeated as `ntagen replay` does. Of each synthesis, the model must be the one
that the record names; the strategy is played against every move of its opponent, as `ntagen verify`
does; and every plan gets a new certificate in exact kinematics. A strategy against a tissue that
answers is followed through all its branches.

The measurements themselves, and the truth of a simulated run, cannot be checked: they are taken as
the log has them.
"""

from __future__ import annotations

import gzip
import hashlib
import io
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final, Literal

from ntagen.checker import load
from ntagen.drive.log import STRATEGY
from ntagen.drive.reading import RunLog
from ntagen.drive.records import Synthesised
from ntagen.drive.replay import replay
from ntagen.drive.simulate import synthesiser_for
from ntagen.drive.trees import require_holding
from ntagen.errors import InputError, LimitError, NtagenError
from ntagen.plan.certify import certify
from ntagen.plan.document import plan_document, plan_from_json
from ntagen.plan.rank import Candidate
from ntagen.report.told import plans_in

_RELATIVE: Final = 1e-6
_ABSOLUTE: Final = 1e-6
_MOST_BYTES: Final = 256 * 2**20
"""A few packed kilobytes could unpack to more than the memory holds; no strategy is so large."""

_FOLDER: Final = re.compile(r"rebuild-(\d{4,9})/.*", re.ASCII)

Result = Literal["holds", "does not hold", "not covered", "not in the log"]
"""``not covered``: a limit came first, or the check does not cover the model."""


@dataclass(frozen=True, slots=True)
class Check:
    """A check and its result.

    Attributes:
        what: What was checked.
        result: Whether it holds.
        about: More about it, in words.
    """

    what: str
    result: Result
    about: str


def checks_of(log: RunLog) -> Iterator[Check]:
    """Checks a run; the checks come one by one, the decisions first.

    Raises:
        InputError: The log has no scene or no settings.
    """
    yield _decisions(log)
    course = log.course
    if course is not None and course.tree is not None:
        try:
            require_holding(course.tree, log.scene)
        except InputError as error:
            yield Check("strategy against the tissue", "does not hold", str(error))
        else:
            about = f"{course.tree.leaves} branches reach the target and touch nothing"
            yield Check("strategy against the tissue", "holds", about)
    records = {one.number: one for one in log.records if isinstance(one, Synthesised)}
    folders = (_FOLDER.fullmatch(name) for name in log.attachments)
    for number in sorted({*records, *(int(one[1]) for one in folders if one)}):
        yield from _synthesis(log, number, records.get(number))


def _decisions(log: RunLog) -> Check:
    what = "decisions"
    try:
        found = replay(log, synthesiser_for(log.settings))
    except LimitError as error:
        return Check(what, "not covered", str(error))
    except NtagenError as error:
        return Check(what, "does not hold", f"they cannot be repeated: {error}")
    if not found.is_same:
        about = (
            f"a different decision, after {found.compared} equal ones; "
            f"logged: {found.logged or 'nothing'}; now: {found.decided or 'nothing'}"
        )
        return Check(what, "does not hold", about)
    extent = "all" if found.complete else "all logged"
    return Check(what, "holds", f"{extent} {found.compared} are the same again")


def _synthesis(log: RunLog, number: int, record: Synthesised | None) -> Iterator[Check]:
    """The checks of a synthesis. Where a log is cut off, its last one may have no record."""
    folder, what = f"rebuild-{number:04d}", f"synthesis {number}"
    model = _model_in(log, folder)
    if model is None:
        yield Check(f"{what}: model", "not in the log", "")
    else:
        yield _model(f"{what}: model", model, record)
        yield _strategy(f"{what}: strategy", model, log.attachments.get(f"{folder}/{STRATEGY}"))
    if f"{folder}/plans.json" in log.attachments:
        try:
            yield _plans(f"{what}: plans", log, number, record)
        except NtagenError as error:
            yield Check(f"{what}: plans", "does not hold", str(error))
    else:
        yield Check(f"{what}: plans", "not in the log", "")


def _model_in(log: RunLog, folder: str) -> bytes | None:
    """The model of a synthesis; one that is damaged is empty, and so does not fit its digest."""
    if f"{folder}/model.xml" in log.attachments:
        return log.attachments[f"{folder}/model.xml"]
    packed = log.attachments.get(f"{folder}/model.xml.gz")
    return None if packed is None else (_unpacked(packed) or b"")


def _unpacked(packed: bytes) -> bytes | None:
    """What is packed; None if it is damaged, or too large."""
    try:
        with gzip.open(io.BytesIO(packed)) as file:
            data = file.read(_MOST_BYTES + 1)
    except (OSError, EOFError, ValueError):
        return None
    return data if len(data) <= _MOST_BYTES else None


def _model(what: str, model: bytes, record: Synthesised | None) -> Check:
    if record is None:
        return Check(what, "not in the log", "the log ends before the record of the synthesis")
    digest = hashlib.sha256(model).hexdigest()
    if digest != record.model_sha256:
        about = f"its SHA-256 is {digest}, and the record has {record.model_sha256}"
        return Check(what, "does not hold", about)
    return Check(what, "holds", f"SHA-256 {digest}, as in the record")


def _strategy(what: str, model: bytes, packed: bytes | None) -> Check:
    """Plays the strategy against every move of its opponent."""
    if packed is None:
        return Check(what, "not in the log", "the model has no strategy, or it was not kept")
    evidence = _unpacked(packed)
    if evidence is None:
        return Check(what, "does not hold", "it is damaged")
    try:
        checked = load(model.decode(errors="replace")).verify(evidence, "the strategy")
    except LimitError as error:
        return Check(what, "not covered", str(error))
    except NtagenError as error:
        return Check(what, "does not hold", str(error))
    results: dict[bool | None, Result] = {True: "holds", False: "does not hold"}
    return Check(what, results.get(checked.holds, "not covered"), "; ".join(checked.lines))


def _plans(what: str, log: RunLog, number: int, record: Synthesised | None) -> Check:
    """Certifies all attached plans again.

    Raises:
        InputError: The scene or a plan cannot be read.
    """
    name = f"rebuild-{number:04d}/plans.json"
    scene, document, margins = log.scene_of(number), plans_in(log, name), log.settings.margins
    wrong: list[str] = []
    texts = []
    for rank, item in enumerate(document["plans"], start=1):
        if not isinstance(item, dict):
            raise InputError(f"plan {rank} is no object")
        plan = plan_from_json(item.get("actions"))
        again = plan_document(Candidate(plan, certify(plan, scene)), margins, rank)
        texts.append((str(plan), again["certificate"]["critical_clearance_mm"]))
        if not again["holds"]:
            wrong.append(f"plan {rank} does not hold in exact kinematics")
        elif not _is_close(item, again):
            wrong.append(f"plan {rank} has another certificate")
    if record is not None:
        wrong += _unlike(record, texts)
    if wrong:
        return Check(what, "does not hold", "; ".join(wrong))
    count = len(texts)
    if not count:
        return Check(what, "holds", "no plan")
    subject = "the plan holds" if count == 1 else f"all {count} plans hold"
    return Check(what, "holds", f"{subject} in exact kinematics, with the same distances")


def _unlike(record: Synthesised, plans: list[tuple[str, float | None]]) -> Iterator[str]:
    """In what the record of a synthesis differs from its plans, each a text and a clearance."""
    text, clearance_mm = plans[0] if plans else ("", None)
    if record.plan != text:
        yield f"the best plan is '{text}', and the record has '{record.plan}'"
    elif clearance_mm is not None and not _is_close(record.clearance_mm, clearance_mm):
        yield (
            f"the best plan is {clearance_mm:.6g} mm from critical regions, and the record has "
            f"{record.clearance_mm:.6g} mm"
        )


def _is_close(one: Any, other: Any) -> bool:  # noqa: ANN401  parts of JSON
    """Whether two documents have the same values, numbers to one part in a million."""
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(_is_close(one[key], other[key]) for key in one)
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(map(_is_close, one, other))
    if isinstance(one, float | int) and isinstance(other, float | int):
        return math.isclose(one, other, rel_tol=_RELATIVE, abs_tol=_ABSOLUTE)
    return bool(one == other)
