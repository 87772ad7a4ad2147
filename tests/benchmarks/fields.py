"""What a shape from a file costs, and how sharp its distances are.

    python tests/benchmarks/fields.py [--side 128] [--triangles 20480] [--repeats 3]

A ball-like mesh gets a grid of so many points along each side. Printed are the processor times of
computing the field (once for a file), of reading it from the cache, of writing the model, and of
loading the model into the engine; the last has a ratio to the yardstick of 1 s. Then, by distance
from the surface in steps of the grid: how much the distance of the field is below the true one, in
steps, in the median and at most, with a ratio of the greatest loss to the stated error. A ratio of
at most 1 is wanted, and no loss below 0: a distance that is too great would be unsafe.
"""

from __future__ import annotations

import argparse
import math
import os
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from ntagen import checker, nsl
from ntagen.imaging.grid import Wish, Workspace
from ntagen.imaging.meshes import Mesh, checked
from ntagen.imaging.store import kept
from ntagen.imaging.surfaces import field_of_mesh
from ntagen.render import render
from ntagen.scene import Region
from ntagen.shapes import Field
from tests.oracles.solids import mesh_distance

LOAD_S = 1.0
MIDDLE = np.array([0.0, -30.0, 0.0])
TEXT = """environment e {
  needle { radius 30 mm  speed 1 mm/s }
  target T1 sphere (0, -70, 0) mm  radius 10 mm
}
"""


def ball(count: int) -> Mesh:
    """A bumpy ball of about so many triangles, with a radius of 12 mm."""
    rows = max(8, round(math.sqrt(count / 4.0)))
    columns = 2 * rows
    over = np.linspace(0.0, np.pi, rows + 1)[1:-1, None]
    around = np.linspace(0.0, 2.0 * np.pi, columns, endpoint=False)[None, :]
    far = 12.0 + np.sin(3.0 * around) * np.sin(over) ** 3
    grid = np.stack(
        [
            far * np.sin(over) * np.cos(around),
            far * np.sin(over) * np.sin(around),
            far * np.cos(over) + 0.0 * around,
        ],
        axis=-1,
    ).reshape(-1, 3)
    points = np.vstack([grid, [[0, 0, 12.0]], [[0, 0, -12.0]]]) + MIDDLE
    top, bottom = len(grid), len(grid) + 1
    faces = []
    for c in range(columns):
        d = (c + 1) % columns
        faces.append((top, c, d))
        last = (rows - 2) * columns
        faces.append((bottom, last + d, last + c))
        for r in range(rows - 2):
            a, b = r * columns, (r + 1) * columns
            faces += [(a + c, b + c, b + d), (a + c, b + d, a + d)]
    return checked(points, np.array(faces), "ball", None)


def seconds(act: Callable[[], object]) -> float:
    """The processor time of an action."""
    begin = time.process_time()
    act()
    return time.process_time() - begin


def show(what: str, used_s: float, yardstick_s: float | None = None) -> None:
    """A line of the table of times."""
    ratio = "" if yardstick_s is None else f"  ratio {used_s / yardstick_s:6.3f}"
    print(f"{what:<34}{used_s:8.3f} s{ratio}")


def show_losses(field: Field, mesh: Mesh, count: int) -> None:
    """The table of losses."""
    rng = np.random.default_rng(1)
    own = rng.uniform(0.0, 1.0, (count, 3)) * np.array(field.extent_mm)
    points = np.array(field.corner_mm) + own @ np.array(field.axes)
    true = mesh_distance(points, mesh.corners)
    step = max(field.steps_mm)
    lost = (true - field.distance_mm(points)) / step
    print(f"\nstated error {field.error_mm / step:.3f} steps of {step:.3f} mm; {count:,} places")
    print(f"{'steps from the surface':<24}{'median':>8}{'least':>10}{'most':>8}{'ratio':>8}")
    for low, high in ((-1e9, 0.0), (0.0, 1.0), (1.0, 2.0), (2.0, 4.0), (4.0, 8.0), (8.0, 1e9)):
        here = lost[(true >= low * step) & (true < high * step)]
        if len(here):
            name = f"{'inside' if high == 0.0 else f'{low:g} to {high:g}'}"
            ratio = here.max() * step / field.error_mm
            print(
                f"{name:<24}{np.median(here):8.3f}{here.min():10.4f}{here.max():8.3f}{ratio:8.3f}"
            )


def main() -> None:
    """Measures, and prints."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--side", type=int, default=128, help="points along each side of the grid")
    parser.add_argument("--triangles", type=int, default=20_480)
    parser.add_argument("--places", type=int, default=4000, help="places for the losses")
    parser.add_argument("--repeats", type=int, default=3)
    asked = parser.parse_args()
    mesh = ball(asked.triangles)
    size = float((mesh.vertices.max(axis=0) - mesh.vertices.min(axis=0)).max()) + 8.0
    space = Workspace((0.0, 0.0, 0.0), (0.0, -1.0, 0.0), 100.0)
    wish = Wish(space, 4.0, size / (asked.side - 1) * (1.0 + 1e-9))
    with tempfile.TemporaryDirectory() as folder:
        os.environ["XDG_CACHE_HOME"] = folder
        fields: list[Field] = []

        def once() -> None:
            fields.append(kept("benchmark", lambda: field_of_mesh(mesh, wish, "ball")))

        made_s = seconds(once)
        cached_s = statistics.median(seconds(once) for _ in range(asked.repeats))
    field = fields[0]
    scene = nsl.loads(TEXT)
    scene = replace(scene, criticals=(Region("C", "critical", field),))
    texts: list[str] = []
    wrote_s = statistics.median(
        seconds(lambda: texts.append(render(scene))) for _ in range(asked.repeats)
    )
    loaded_s = statistics.median(
        seconds(lambda: checker.load(texts[0])) for _ in range(asked.repeats)
    )
    grid = " x ".join(map(str, field.counts))
    print(
        f"{len(mesh.triangles):,} triangles, a grid of {grid}: {len(field.samples) // 4:,} points"
    )
    show("field from the mesh, once", made_s)
    show("field from the cache", cached_s)
    show("model written", wrote_s)
    show("model loaded by the engine", loaded_s, LOAD_S)
    show_losses(field, mesh, asked.places)


if __name__ == "__main__":
    main()
