"""Files of experiments for tests."""

from __future__ import annotations

from pathlib import Path

SCENARIOS = Path(__file__).resolve().parents[3] / "examples" / "scenarios"

QUICK = """
name = "quick"
[defaults]
noise = "0.1 mm"
seeds = 3
[[row]]
id = "blocked"
scenario = "large_mid_cr.nsl"
[[row]]
id = "free"
scenario = "no_cr.nsl"
seeds = [7, 4]
drive = { "initial push" = "4 mm" }
"""
"""Five runs, which take less than a second."""


def scene(name: str) -> str:
    """The text of a scenario."""
    return (SCENARIOS / name).read_text("utf-8")


def written(folder: Path, text: str = QUICK) -> Path:
    """The file with this text, beside copies of all scenarios."""
    for path in SCENARIOS.glob("*.nsl"):
        (folder / path.name).write_text(scene(path.name), "utf-8")
    file = folder / "quick.toml"
    file.write_text(text, "utf-8")
    return file
