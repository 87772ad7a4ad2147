"""Other values in the text of a file: all else stays, and what cannot be changed is refused."""

from __future__ import annotations

import pytest

from ntagen import nsl
from ntagen.errors import InputError
from ntagen.nsl.revise import revised

TEXT = """// A needle. { not a brace }
let R = 30 mm
environment one {
  needle {  // the needle }
    tip (0, 0, 0) mm  heading -y  bevel +z
    radius 2 * R  speed 1 mm/s  // twice }
  }
  motion { step 2 s  roll by 90 deg at most 1 times at least 2 mm apart }
  target T1 sphere (0, -50, 0) mm radius 10 mm
%s}
"""
PLAIN = TEXT % ""


def test_values_are_replaced_and_all_else_stays() -> None:
    found = revised(PLAIN, "one.nsl", {"radius": "55.5 mm", "bevel": "+x"}, {})
    assert found == PLAIN.replace("2 * R", "55.5 mm").replace("+z", "+x")
    assert nsl.loads(found).needle.radius_mm == 55.5


def test_a_property_that_is_not_there_is_added() -> None:
    found = revised(PLAIN, "one.nsl", {"length": "120 mm"}, {})
    assert found == PLAIN.replace("(0, 0, 0) mm  heading", "(0, 0, 0) mm  length 120 mm  heading")
    assert nsl.loads(found).needle.length_mm == 120.0


def test_braces_of_the_driver_are_added_behind_those_of_the_needle() -> None:
    found = revised(PLAIN, "one.nsl", {}, {"pull": "8 mm", "push": "1 mm"})
    added = "\n\n  drive {\n    pull 8 mm\n    push 1 mm\n  }"
    assert found == PLAIN.replace("// twice }\n  }", f"// twice }}\n  }}{added}")
    assert [one.value for one in nsl.loads_task(found).given] == [8.0, 1.0]


@pytest.mark.parametrize(
    ("drive", "expected"),
    [
        ("  drive { pull 9 mm }\n", "  drive { push 1 mm  pull 8 mm }\n"),
        ("  drive {\n    pull 9 mm\n  }\n", "  drive {\n    push 1 mm\n    pull 8 mm\n  }\n"),
        ("  drive { }\n", "  drive { push 1 mm  pull 8 mm  }\n"),
        ("  drive { ranking rolls, length }\n", None),
    ],
)
def test_settings_are_replaced_or_added(drive: str, expected: str | None) -> None:
    changes = {"pull": "8 mm", "push": "1 mm"} if expected else {"ranking": "length"}
    found = revised(TEXT % drive, "one.nsl", {}, changes)
    given = {one.parameter.words: one.value for one in nsl.loads_task(found).given}
    if expected is None:
        assert given == {"ranking": ("length",)}
    else:
        assert given == {"pull": 8.0, "push": 1.0}
        assert found.split() == (TEXT % expected).split() or "{ }" in drive


def test_twice_is_once() -> None:
    changes = ({"radius": "41 mm"}, {"lag compensation": "30 deg"})
    once = revised(PLAIN, "one.nsl", *changes)
    assert revised(once, "one.nsl", *changes) == once


def test_a_mark_at_the_beginning_and_carriage_returns_stay() -> None:
    text = "\ufeff" + PLAIN.replace("\n", "\r\n")
    found = revised(text, "one.nsl", {"radius": "41 mm"}, {"pull": "8 mm"})
    assert found.startswith("\ufeff// A needle")
    assert found.count("\n") == found.count("\r\n")


def test_what_is_no_file_with_a_needle_is_refused() -> None:
    with pytest.raises(InputError, match=r"there is no needle \{ … \} in this file"):
        revised("let a = 1 mm\n", "let.nsl", {"radius": "1 mm"}, {})
    with pytest.raises(nsl.SourceError, match=r"bad\.nsl:1"):
        revised("environment { needle\n", "bad.nsl", {"radius": "1 mm"}, {})
