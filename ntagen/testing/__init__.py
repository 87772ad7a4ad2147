"""Tests for the authors of plugins: whether a device or a tracker keeps the protocol.

``ntagen device test NAME:ARGUMENT`` runs them on the command line. In a test of your own::

    from ntagen.plugins import Speeds
    from ntagen.testing import device_contract, require

    def test_my_stage_keeps_the_protocol() -> None:
        with open_stage("simulated", Speeds()) as stage:
            require(device_contract(stage, Speeds()))
"""

from __future__ import annotations

from ntagen.testing.checks import Check, require
from ntagen.testing.device import device_contract
from ntagen.testing.tracker import tracker_contract

__all__ = ["Check", "device_contract", "require", "tracker_contract"]
