"""Leads a run along a strategy against the tissue, and records what is seen and guaranteed."""

from __future__ import annotations

import math

from ntagen.drive.following import Course, Following
from ntagen.drive.posterior import Promise
from ntagen.drive.records import Followed, Guaranteed, Journal
from ntagen.drive.settings import Settings
from ntagen.drive.steering import Steering
from ntagen.plan.actions import Action
from ntagen.plan.closed_loop import Segment
from ntagen.scene import Pose, Scene, Vector


class Guide:
    """What leads a run while a strategy is followed; it is off from the start without one.

    Args:
        course: How the run goes; None where the tissue does not answer.
        scene: The a-priori scene.
        settings: How to drive.
        needle: The needle.
        journal: Records what is seen.

    Attributes:
        course: How the run goes.
        reason: Why no strategy is followed; empty while one is.
    """

    def __init__(
        self,
        course: Course | None,
        scene: Scene,
        settings: Settings,
        needle: Steering,
        journal: Journal,
    ) -> None:
        self.course = course
        self._settings = settings
        self._needle = needle
        self._journal = journal
        self._scene = scene
        self._tree: Segment | None = None if course is None else course.tree
        self._following: Following | None = None
        if self._tree is not None:
            self._following = Following(self._tree, scene, settings)
        self.reason = "" if course is None else course.lack

    def begin(self, promise: Promise) -> None:
        """Follows a strategy that begins where the needle is now, instead of another one."""
        self._scene, self._tree = promise.scene, promise.tree
        depth_mm = self._needle.depth_mm
        self._following = Following(promise.tree, promise.scene, self._settings, depth_mm)

    @property
    def is_on(self) -> bool:
        """Whether the strategy is followed."""
        return self._following is not None

    @property
    def had_strategy(self) -> bool:
        """Whether there was a strategy at the start."""
        return self.course is not None and self.course.tree is not None

    @property
    def forbids_plans(self) -> bool:
        """Whether the run must end, since nothing is guaranteed any more."""
        return self.course is not None and self.course.only_guaranteed and not self.is_on

    @property
    def text(self) -> str:
        """The strategy in words, for the operator."""
        return f"follow the strategy against the tissue, with {self.root.leaves} branches"

    def longest_s(self, tree: Segment) -> float:
        """How long the longest branch of a strategy takes, with as many rolls as may be made."""
        rolls = self._scene.limits.max_rolls + 1
        speed_mm_per_s = self._scene.needle.speed_mm_per_s
        rolls_s = rolls * math.pi / self._settings.roll_rad_per_s
        return tree.longest_mm / speed_mm_per_s + rolls_s

    def next(self) -> tuple[Action, Pose] | None:
        """See `Following.next`."""
        return self._on().next()

    def expected(self) -> Pose:
        """See `Following.expected`."""
        return self._on().expected()

    def note(self, position_mm: Vector) -> None:
        """Takes a reading; records the end of a branch."""
        following = self._on()
        following.note(self._needle.depth_mm, position_mm)
        if self.course is not None:
            self._needle.believe(following.path())
        seen = following.seen() if following.is_near() else None
        if seen is None:
            return
        branch = seen.branch
        self._journal.record(
            Followed(
                self._needle.now_s(),
                self._needle.depth_mm,
                tuple(map(float, seen.way)),
                branch.factor,
                branch.roll_error_rad,
                seen.off_mm,
                seen.decision,
            )
        )

    def leave_if_lost(self) -> bool:
        """Ends the strategy if no branch explains where the tip is; returns whether it did."""
        following = self._on()
        if following.is_near():
            return False
        self.leave(
            f"the tip is {following.off_mm():.3f} mm off the nearest branch, and "
            f"{following.allowed_mm:.3g} mm is allowed"
        )
        return True

    def leave(self, reason: str = "") -> None:
        """Ends the strategy, if it is followed; without a reason at the end of a branch."""
        following, self._following = self._following, None
        if following is None:
            return
        self.reason = reason
        self._journal.record(
            Guaranteed(
                self._needle.now_s(),
                following.held_until_mm,
                following.most_off_mm,
                following.allowed_mm,
                reason,
            )
        )

    def _on(self) -> Following:
        if self._following is None:
            raise AssertionError("no strategy is followed")
        return self._following

    @property
    def root(self) -> Segment:
        """The strategy that was followed last."""
        if self._tree is None:
            raise AssertionError("there is no strategy")
        return self._tree
