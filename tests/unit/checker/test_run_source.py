"""Runs that are made elsewhere: the answer is that of one machine, bit by bit."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from ntagen import checker
from ntagen.checker import Options

MODEL = """
clock x; int n;
process Q() { state A { x <= 4 }, B; init A; trans A -> B { guard x >= 2; }; }
process R() { state A { ; 5 }; init A; trans A -> A { guard n < 9; assign n++; }; }
system Q, R;
"""

QUERIES = [
    "Pr[<=3](<> Q.B)",
    "Pr[<=3]([] !Q.B)",
    "Pr[#<=9; 500](Q.A U n >= 5)",
    "Pr[<=3](<>[1,2] n > 4)",
    "Pr[<=3](<> Q.B) >= 0.45",
    "Pr[<=3](<> Q.B) >= Pr[<=3](<> n > 8)",
    "Pr[<=3](<> Q.B) <= Pr[<=3](<> Q.B)",
    "E[<=1; 777](max: n)",
    "E[<=1; 777](min: x - n)",
]


def elsewhere(
    query: str,
    size: int,
    text: str = MODEL,
    **keywords: Any,  # noqa: ANN401
) -> tuple[Callable[[int, int | None], bytes], list[tuple[int, int | None]]]:
    """Another model that makes blocks of this size, and what it will have been asked."""
    model, asked = checker.load(text), list[tuple[int, int | None]]()

    def source(first: int, most: int | None) -> bytes:
        asked.append((first, most))
        # Now and then nothing is there yet.
        if len(asked) % 3 == 0:
            return b""
        return model.block_of_runs(query, first, size, Options(**keywords))

    return source, asked


def facts(answer: checker.Answer) -> tuple[object, ...]:
    """All that an answer says but for its times."""
    known = answer.distribution
    shown = known and (known.to_json(), known.values.tobytes(), known.counts.tobytes())
    return (answer.verdict, answer.value, answer.estimate, answer.message, answer.stop, shown)


@pytest.mark.parametrize("size", [1, 7, 5000])
@pytest.mark.parametrize("query", QUERIES)
def test_answers_do_not_depend_on_who_makes_the_runs(query: str, size: int) -> None:
    keywords: dict[str, Any] = {"epsilon": 0.03, "seed": 5}
    if "<= Pr" in query:
        # These two are never told apart.
        keywords["runs"] = 2000
    here = checker.load(MODEL).check(query, **keywords)
    source, asked = elsewhere(query, size, **keywords)
    there = checker.load(MODEL).check(query, run_source=source, **keywords)
    assert facts(there) == facts(here)
    assert asked[0][0] == 0
    assert asked[-1][0] > 0 or len(asked) == 1


@pytest.mark.parametrize(
    ("query", "keywords", "most"),
    [
        ("Pr[<=3](<> Q.B)", {"runs": 50}, 50),
        ("Pr[<=3; 60](<> Q.B)", {}, 60),
        ("Pr[<=3](<> Q.B)", {}, None),
        ("E[<=3; 70](max: n)", {}, 70),
    ],
)
def test_it_is_said_how_many_runs_are_needed(
    query: str, keywords: dict[str, Any], most: int | None
) -> None:
    source, asked = elsewhere(query, 10)
    checker.load(MODEL).check(query, run_source=source, **keywords)
    assert {one[1] for one in asked} == {most}


def test_results_that_repeat_take_no_room() -> None:
    model = checker.load(MODEL)
    seldom = model.block_of_runs("Pr[<=3](<> n > 100)", 0, 100_000, Options())
    assert len(seldom) < 20
    values = model.block_of_runs("Pr[<=3](<> Q.B)", 0, 1000, Options())
    assert len(values) <= 10 * 1000


BROKEN = """
clock x; int n; int[0,3] small;
process R() { state A { ; 5 }; init A; trans A -> A { assign n++, small = n; }; }
system R;
"""


def test_a_run_that_fails_is_an_error_with_its_place() -> None:
    query = "Pr[<=1; 400](<> n > 100)"
    with pytest.raises(checker.RejectedError) as here:
        checker.load(BROKEN).check(query)
    source, asked = elsewhere(query, 50, BROKEN)
    with pytest.raises(checker.RejectedError) as there:
        checker.load(BROKEN).check(query, run_source=source)
    assert "small = n" in str(there.value)
    assert str(there.value) == str(here.value)
    assert len(asked) < 4


def test_a_failure_behind_the_last_run_does_not_count() -> None:
    query = "Pr[<=1](<> n > 100)"
    text = BROKEN.replace("; 5", "; 1")

    def fails(runs: int) -> bool:
        try:
            checker.load(text).check(query, runs=runs)
        except checker.RejectedError:
            return True
        return False

    good = next(runs for runs in range(1, 500) if fails(runs + 1))
    source, _ = elsewhere(query, 600, text)
    answer = checker.load(text).check(query, runs=good, run_source=source)
    assert answer.estimate is not None
    assert answer.estimate.runs == good


SPAWNED = """
dynamic Child();
process Child() { state A { ; 0.2 }, B; init A; trans A -> B { assign exit(); }; }
process Mother() { state S { ; 8 }; init S; trans S -> S { assign spawn Child(); }; }
system Mother;
"""


def test_there_is_room_for_instances_on_both_sides() -> None:
    query = "E[<=9; 60](max: numOf(Child))"
    here = checker.load(SPAWNED).check(query)
    assert isinstance(here.value, float)
    assert here.value > 10
    source, _ = elsewhere(query, 25, SPAWNED)
    assert facts(checker.load(SPAWNED).check(query, run_source=source)) == facts(here)


@pytest.mark.parametrize("rubbish", [b"\x05", b"\xff" * 30, b"\x01\x07abcdefgh", b"\x00\x00"])
def test_what_cannot_be_read_is_made_here(rubbish: bytes) -> None:
    query = "Pr[<=3; 40](<> Q.B)"
    here = checker.load(MODEL).check(query)
    there = checker.load(MODEL).check(query, run_source=lambda *_: rubbish)
    assert facts(there) == facts(here)


def test_what_the_source_raises_comes_out() -> None:
    def broken(*_: object) -> bytes:
        raise ConnectionError("the line is cut")

    with pytest.raises(ConnectionError, match="the line is cut"):
        checker.load(MODEL).check("Pr[<=3](<> Q.B)", run_source=broken)


def test_no_bytes_are_an_error() -> None:
    def broken(*_: object) -> bytes:
        return "text"  # type: ignore[return-value]

    with pytest.raises(TypeError):
        checker.load(MODEL).check("Pr[<=3](<> Q.B)", run_source=broken)


def test_the_user_gets_the_runs_so_far() -> None:
    model = checker.load(MODEL)

    def source(first: int, _: int | None) -> bytes:
        if first >= 300:
            raise KeyboardInterrupt
        return model.block_of_runs("Pr[<=3](<> Q.B)", first, 100, Options())

    with pytest.raises(checker.Interrupted) as caught:
        checker.load(MODEL).check("Pr[<=3](<> Q.B)", epsilon=0.001, run_source=source)
    assert caught.value.answer.stop == "interrupted"
    assert caught.value.answer.estimate is not None
    assert caught.value.answer.estimate.runs == 300


def test_time_ends_what_never_comes() -> None:
    answer = checker.load(MODEL).check("Pr[<=3](<> Q.B)", timeout_s=0.2, run_source=lambda *_: b"")
    assert (answer.verdict, answer.stop, answer.estimate) == ("unknown", "time", None)


@pytest.mark.parametrize("query", ["simulate[<=3]{n}", "E<> Q.B"])
def test_blocks_are_of_probabilities_and_means(query: str) -> None:
    with pytest.raises(ValueError, match="no results to count"):
        checker.load(MODEL).block_of_runs(query, 0, 10, Options())
