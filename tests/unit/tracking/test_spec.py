"""The words of ``--tracker``."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ntagen.errors import InputError
from ntagen.openigtlink.samples import Policy
from ntagen.tracking.frames import IDENTITY
from ntagen.tracking.live import Source
from ntagen.tracking.mount import Mount
from ntagen.tracking.spec import OPTIONS, Recording, open_tracker, parse_tracker


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("openigtlink:localhost:18944", Source("localhost", 18944)),
        ("openigtlink:10.0.0.7:1:NeedleTip", Source("10.0.0.7", 1, "NeedleTip")),
        ("openigtlink:[::1]:65535:A B", Source("::1", 65535, "A B")),
        ("openigtlink:h:2:", Source("h", 2)),
        (
            "openigtlink:h:2:N,bevel=+x,axis=-z,tip=0/-1.5/120",
            Source("h", 2, "N", Mount("-z", "+x", (0.0, -1.5, 120.0))),
        ),
        (
            "openigtlink:h:2,force=F,force-index=3,force-unit=mN,latency=40ms,sends=changes",
            Source(
                "h", 2, force="F", force_index=2, force_unit="mN", latency_s=0.04, repeats=False
            ),
        ),
        (
            "openigtlink:h:2,stale=200ms,tdata=50ms,frame=Patient,sends=always",
            Source("h", 2, policy=Policy(stale_s=0.2, interval_ms=50, frame="Patient")),
        ),
        ("csv:a:b,c.csv", Recording("csv", Path("a:b,c.csv"))),
        ("mcap:run.mcap", Recording("mcap", Path("run.mcap"))),
        ("shape:s.csv", Recording("shape", Path("s.csv"))),
    ],
)
def test_words_that_are_right(text: str, expected: object) -> None:
    assert parse_tracker(text) == expected


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("", "there is no tracker ''\nhint: write openigtlink:HOST:PORT"),
        ("plus:localhost:1", "there is no tracker 'plus"),
        ("csv", "there is no tracker 'csv'"),
        ("csv:", "the file is missing"),
        ("openigtlink:", "host and port are missing"),
        ("openigtlink:localhost", "host and port are missing"),
        ("openigtlink::18944", "host and port are missing"),
        ("openigtlink:::1:18944", "host and port are missing"),
        ("openigtlink:h:", "'' is not a port"),
        ("openigtlink:h:0", "'0' is not a port"),
        ("openigtlink:h:65536", "'65536' is not a port"),
        ("openigtlink:h:-1", "'-1' is not a port"),
        ("openigtlink:h:Needle", "'Needle' is not a port"),
        ("openigtlink:h:1,colour=red", "no option 'colour'\nhint: the options are axis, bevel"),
        ("openigtlink:h:1,", "no option ''"),
        ("openigtlink:h:1,axis", "axis= is wrong"),
        ("openigtlink:h:1,axis=z", "axis=z is wrong\nhint: axis is the tool's axis"),
        ("openigtlink:h:1,axis=+x,bevel=-x", "on one line"),
        ("openigtlink:h:1,tip=1/2", "tip=1/2 is wrong"),
        ("openigtlink:h:1,tip=1/2/inf", "is wrong"),
        ("openigtlink:h:1,force-index=0", "is wrong"),
        ("openigtlink:h:1,force-unit=lbf", "is wrong"),
        ("openigtlink:h:1,stale=200", "stale=200 is wrong"),
        ("openigtlink:h:1,stale=0s", "is wrong"),
        ("openigtlink:h:1,stale=2h", "is wrong"),
        ("openigtlink:h:1,sends=never", "is wrong"),
    ],
)
def test_words_that_are_wrong(text: str, match: str) -> None:
    with pytest.raises(InputError, match=match.replace("+", r"\+")):
        parse_tracker(text)


def refusal(words: str) -> str | None:
    """Why words are refused; `None` if they are not."""
    try:
        parse_tracker(words)
    except InputError as error:
        return str(error)
    return None


@given(st.text(max_size=30) | st.text("openigtlink:csv,=[]/0129+-xz.sm", max_size=40))
def test_any_words_give_a_tracker_or_a_message(text: str) -> None:
    for words in (text, f"openigtlink:h:1,{text}"):
        error = refusal(words)
        assert error is None or "hint:" in error


def test_each_option_is_known() -> None:
    examples = {"axis": "+x", "bevel": "+x", "tip": "1/2/3", "force": "F", "force-index": "2"}
    examples |= {"force-unit": "N", "stale": "1s", "latency": "1ms", "tdata": "20ms"}
    examples |= {"frame": "F", "checksum": "optional", "sends": "changes"}
    assert list(examples) == list(OPTIONS)
    for name, value in examples.items():
        found = parse_tracker(f"openigtlink:h:1,{name}={value}")
        assert found != Source("h", 1), name


def test_a_server_needs_a_registration() -> None:
    with (
        pytest.raises(InputError, match="nothing says where the scene lies"),
        open_tracker(Source("localhost", 1), None, lambda: 0.0),
    ):
        pass


def test_a_log_needs_none(tmp_path: Path) -> None:
    turned = IDENTITY.between("scene", "scene")
    other = type(turned)("tracker", "scene", turned.rotation, (1.0, 0.0, 0.0))
    with (
        pytest.raises(InputError, match="in the scene's frame already"),
        open_tracker(Recording("mcap", tmp_path / "r.mcap"), other, lambda: 0.0),
    ):
        pass


def test_the_documentation_has_each_option() -> None:
    text = (Path(__file__).parents[3] / "docs" / "tracking.md").read_text("utf-8")
    assert re.findall(r"^\| `([a-z-]+)` \|", text, re.MULTILINE) == list(OPTIONS)
