"""Draws the pictures of a tutorial again, by what the tutorial tells readers to type.

    .venv/bin/python -m tests.tutorial_pictures confidence

They go to the folder beside the page that has its name. Look at them before you commit them.
"""

from __future__ import annotations

import re
import shutil
import sys
import tempfile
from pathlib import Path

from tests.tutorials import ROOT, follow


def pictures_of(page: Path) -> list[Path]:
    """The pictures that a page shows from its own folder."""
    found = re.findall(rf"\]\(({page.stem}/[\w.-]+)\)", page.read_text("utf-8"))
    return [page.parent / one for one in found]


def draw(page: Path) -> None:
    """Follows a page, and takes its pictures."""
    with tempfile.TemporaryDirectory() as folder:
        differences = list(follow(page.read_text("utf-8"), Path(folder)))
        if differences:
            sys.exit("\n".join(differences))
        for picture in pictures_of(page):
            picture.parent.mkdir(exist_ok=True)
            shutil.copyfile(Path(folder) / picture.name, picture)
            print(picture.relative_to(ROOT))


if __name__ == "__main__":
    for name in sys.argv[1:]:
        draw(ROOT / "docs" / "tutorials" / f"{name}.md")
