"""Makes the device and the tracker that a draft describes (`ntagen.hardware`)."""

from __future__ import annotations

from ntagen import hardware
from ntagen.hardware import Axis, GrblDevice, OpenIGTLinkTracker
from ntagen.nsl.diagnostics import Reporter
from ntagen.nsl.draft import Draft, DraftDevice


def grbl_device(draft: Draft, reporter: Reporter) -> GrblDevice | None:
    """The device that the file describes, or None without one or after an error."""
    device = draft.devices.get("device")
    if device is None or device.address.value is None:
        return None
    insert, roll = (_axis(word, device, draft, reporter) for word in ("insert", "roll"))
    if insert is None or roll is None:
        return None
    return GrblDevice(device.address.value, insert, roll)


def _axis(word: str, device: DraftDevice, draft: Draft, reporter: Reporter) -> Axis | None:
    """An axis of a device, or None after an error."""
    if word not in device.axes:
        if f"axis {word}" not in draft.seen and not draft.has_gaps:
            form = "insert X 80 steps/mm" if word == "insert" else "roll A 8.89 steps/deg"
            reporter.report(
                "axis-missing",
                device.address.span,
                f"the device has no axis to {word}",
                hint=f"add for example `{form}`",
            )
        return None
    placed_letter, placed_steps = device.axes[word]
    letter = placed_letter.obeying(reporter, hardware.axis_letter)
    steps = placed_steps.obeying(reporter, hardware.axis_steps)
    return None if letter is None or steps is None else Axis(letter, steps)


def tracker(draft: Draft, reporter: Reporter) -> OpenIGTLinkTracker | None:
    """The tracker that the file describes, or None without one or after an error."""
    device = draft.devices.get("tracker")
    address = None if device is None else device.address.obeying(reporter, hardware.address)
    if device is None or address is None:
        return None
    return OpenIGTLinkTracker(*hardware.host_and_port(address), device.name)
