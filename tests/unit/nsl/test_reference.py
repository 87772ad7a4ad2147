"""The language reference: every example in it is read."""

from __future__ import annotations

import re
import textwrap
from pathlib import Path

import pytest

from ntagen import nsl
from ntagen.nsl.tokens import KEYWORDS

REFERENCE = Path(nsl.__file__).with_name("README.md").read_text("utf-8")
EXAMPLES = re.findall(r"^```(nsl[-a-z]*)\n(.*?)^```$", REFERENCE, re.MULTILINE | re.DOTALL)

NEEDLE = "needle { radius 30 mm  speed 1 mm/s }"
TARGET = "target Last sphere (0, -50, 0) mm radius 10 mm"
FRAMES = {
    "nsl": "%s",
    "nsl-top": f"%s\nenvironment e {{ {NEEDLE} {TARGET} }}",
    "nsl-include": f"%s\nenvironment e {{ {NEEDLE} {TARGET} }}",
    "nsl-body": f"environment e {{ {NEEDLE}\n%s}}",
    "nsl-needle": f"environment e {{ needle {{\n%s}} {TARGET} }}",
    "nsl-motion": f"environment e {{ {NEEDLE} {TARGET} motion {{\n%s}} }}",
}


IN_FILES = "nsl-files"
"""Examples of regions from files that are not there; their words are checked only."""


def test_examples_of_files_are_in_the_standard_layout() -> None:
    for kind, text in EXAMPLES:
        if kind == IN_FILES:
            written = FRAMES["nsl-body"] % text
            assert text.split() == nsl.format_text(written).partition("}")[2][:-3].split()


@pytest.mark.parametrize(("kind", "text"), [e for e in EXAMPLES if e[0] != IN_FILES])
def test_example_is_right(kind: str, text: str, tmp_path: Path) -> None:
    (tmp_path / "lets.nsl").write_text("let width = 3 mm\n", "utf-8")
    warnings = nsl.loads_task(FRAMES[kind] % text, str(tmp_path / "env.nsl")).warnings
    assert warnings == ()


def test_every_keyword_has_an_example() -> None:
    words = set(re.findall(r"\w+", "".join(text for _, text in EXAMPLES)))
    assert words >= KEYWORDS


def test_example_of_a_mistake_is_what_is_said() -> None:
    text = textwrap.dedent(
        f"""\
        environment e {{
          {NEEDLE}
          {TARGET}
          critical C1 sphere (0, -25, 0) mm raduis 2 mm
        }}
        """
    )
    with pytest.raises(nsl.SourceError) as caught:
        nsl.loads(text, "env.nsl")
    (shown,) = re.findall(r"^```text\n(.*?)\n```$", REFERENCE, re.MULTILINE | re.DOTALL)
    assert str(caught.value) == shown
