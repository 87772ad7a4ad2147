"""What it costs if the tissue picks at each push, and not once in each segment: states and times.

    python tests/benchmarks/picks.py [--seconds 60]

The scene is small: three angles, one target and nothing in the way. In each row the same question
is asked of the model as it is, and of one in which the tissue bends the needle anew at each push,
by the least, the expected or the largest curvature. The verdicts may differ: against the second
tissue it is harder to win.
"""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from ntagen import checker
from ntagen.plan.synthesise import GUIDE, STRATEGY_QUERY
from ntagen.render import render
from ntagen.scene import Limits, Needle, Pose, Region, Scene, Tissue

DOWN = Pose((0.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0))
AGAIN = """
void bend_again(int bend) {
    motion_circle_r = circle_radii[bend];
    tip_roll = 0;
    update_action_rotation_matrix();
    update_circle_center();
}
"""


def scene_of(depth_mm: float, rolls: int, step_mm: float) -> Scene:
    """A target straight below the entry, a little aside."""
    return Scene(
        name="small",
        needle=Needle(DOWN, 30.0, 1.0, depth_mm + 9.0),
        axis=DOWN.heading,
        limits=Limits(step_mm, (math.pi / 2, math.pi, 3 * math.pi / 2), rolls, 0.0),
        targets=(Region.ball("T", "target", (0.0, -depth_mm, -3.0), 7.0),),
        tissue=Tissue("adversarial", 0.05, math.radians(2.0), 0.2),
        resolution_per_mm=100_000,
        safety="swept",
    )


def at_each_push(model: str) -> str:
    """The model with a tissue that bends the needle anew at each push."""
    end = model.index("\n}", model.index("void pick(int bend, int twist)")) + 2
    model = model[:end] + AGAIN + model[end:]
    at = model.index("is_pushing &amp;&amp; is_picked")
    begin = model.rindex("<label", 0, at)
    step = model.index("step()", at)
    select = '<label kind="select">bend : int[0, BEND_COUNT - 1]</label>'
    return model[:begin] + select + model[begin:step] + "bend_again(bend), " + model[step:]


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seconds", type=float, default=60.0)
    asked = parser.parse_args()
    print("depth  rolls  step  picks at       verdict         explored    stored  seconds")
    rows = ((26, 1, 5), (36, 1, 5), (36, 2, 5), (36, 3, 5), (36, 1, 3), (36, 2, 3), (36, 2, 2))
    for depth_mm, rolls, step_mm in rows:
        model = render(scene_of(depth_mm, rolls, step_mm), only_plans=True)
        for name, text in (("each segment", model), ("each push", at_each_push(model))):
            found = checker.load(text).check(
                STRATEGY_QUERY, guide=GUIDE, timeout_s=asked.seconds, memory_bytes=2 << 30
            )
            print(
                f"{depth_mm:5}  {rolls:5}  {step_mm:4}  {name:13}  {found.stop or found.verdict:14}"
                f"{found.explored:10}{found.stored:10}{found.seconds:9.2f}",
                flush=True,
            )


if __name__ == "__main__":
    main()
