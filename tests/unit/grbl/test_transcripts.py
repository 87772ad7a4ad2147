"""The emulator answers the recorded stimuli as both firmwares did.

All replies are compared line by line and word by word, with these exceptions:

* In status reports, positions may differ by 0.15 mm and the feed by 40 mm/min (GRBL) or 12 mm/min
  (grblHAL): a real-time byte reached the recorded firmware up to 40 ms late, which is 0.33 mm at
  500 mm/min and was in fact less.
* The times of replies are not compared: they are those of the simulators in which the firmwares
  ran, and of their serial port. A line is given to the emulator when the firmware answered it.
* The clock of GRBL's simulator ran 2.385 times as fast until 21.4 s, as the positions in its
  reports show, and then in real time; the emulator's clock runs the same way here.
* GRBL's banner at power-up is not in its recording, which begins after it.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from ntagen.grbl.dialects import GRBL_11H, GRBLHAL, Dialect
from ntagen.grbl.emulator import Emulator
from ntagen.grbl.memory import Memory

DATA = Path(__file__).parents[2] / "data" / "grbl"
STIMULI = 49
POSITION_BOUND_MM = 0.15
RUSH, RUSH_END_S = 2.385, 21.4


@dataclass
class Exchange:
    """What was sent, and what came until the next thing was sent."""

    time_s: float
    sent: str
    replies: list[tuple[float, str]] = field(default_factory=list)


def exchanges(name: str) -> list[Exchange]:
    """A recording; what came before anything was sent is the first exchange."""
    found = [Exchange(0.0, "")]
    for line in (DATA / name).read_text().splitlines():
        item = json.loads(line)
        if "tx" in item:
            found.append(Exchange(item["t"], item["tx"]))
        else:
            found[-1].replies.append((item["t"], item["rx"]))
    return found


def rushed(time_s: float) -> float:
    """The clock of the simulator in which GRBL was recorded."""
    return RUSH * min(time_s, RUSH_END_S) + max(0.0, time_s - RUSH_END_S)


def real(time_s: float) -> float:
    return time_s


def play(
    recorded: list[Exchange], dialect: Dialect, clock: Callable[[float], float], *, is_blank: bool
) -> list[list[str]]:
    """What the emulator answers to each thing that was sent."""
    emulator = Emulator(dialect, memory=Memory(dialect, is_blank=is_blank))
    emulator.power_on()
    answers: list[list[str]] = []

    def collect(until_s: float) -> None:
        emulator.advance(until_s)
        answers.append(emulator.take().decode("ascii").split("\r\n")[:-1])

    for exchange in recorded[1:]:
        at_s = exchange.time_s
        delay_s = dialect.status_s if exchange.sent == "?" else dialect.line_s
        if exchange.replies and exchange.sent.endswith(("\n", "?")):
            at_s = max(at_s, exchange.replies[0][0] - delay_s)
        collect(clock(at_s))
        emulator.feed(exchange.sent.encode("latin-1"))
    collect(emulator.now_s + 2.0)
    return answers


def assert_same(recorded: str, answer: str, feed_bound: float) -> None:
    """Compares two lines; in status reports the position and the feed may differ a little."""
    pattern = re.compile(r"MPos:([^|]+)\|(.*)FS:([0-9]+),0(.*)")
    ours, theirs = pattern.search(answer), pattern.search(recorded)
    if ours is None or theirs is None:
        assert answer == recorded
        return
    assert (ours[2], ours[4]) == (theirs[2], theirs[4])
    assert answer[: ours.start()] == recorded[: theirs.start()]
    positions = [[float(p) for p in found[1].split(",")] for found in (ours, theirs)]
    assert positions[0] == pytest.approx(positions[1], abs=POSITION_BOUND_MM)
    assert float(ours[3]) == pytest.approx(float(theirs[3]), abs=feed_bound)


@pytest.mark.parametrize(
    ("name", "dialect", "clock", "is_blank", "feed_bound"),
    [
        pytest.param("grbl11h.jsonl", GRBL_11H, rushed, False, 40.0, id="GRBL 1.1h"),
        pytest.param("grblhal4.jsonl", GRBLHAL, real, True, 12.0, id="grblHAL"),
    ],
)
def test_the_emulator_answers_as_the_firmware_did(
    name: str,
    dialect: Dialect,
    clock: Callable[[float], float],
    is_blank: bool,
    feed_bound: float,
) -> None:
    recorded = exchanges(name)
    answers = play(recorded, dialect, clock, is_blank=is_blank)
    if not is_blank:
        answers[0] = []
    assert len(answers) == len(recorded) == 1 + STIMULI
    for exchange, answer in zip(recorded, answers, strict=True):
        said = [text for _, text in exchange.replies]
        assert len(answer) == len(said), (exchange, answer)
        for ours, theirs in zip(answer, said, strict=True):
            assert_same(theirs, ours, feed_bound)
