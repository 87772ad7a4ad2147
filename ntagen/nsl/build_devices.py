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
    axes = {}
    for word in ("insert", "roll"):
        axis = _axis(word, device, draft, reporter)
        if axis is not None:
            axes[word] = axis
    if len(axes) < 2:
        return None
    return GrblDevice(device.address.value, axes["insert"], axes["roll"])


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
    letter, steps = device.axes[word]
    if letter.value is None or steps.value is None:
        return None
    is_right = reporter.obeys(hardware.axis_letter(letter.value), letter.span)
    if not reporter.obeys(hardware.axis_steps(steps.value), steps.span) or not is_right:
        return None
    return Axis(letter.value, steps.value)


def tracker(draft: Draft, reporter: Reporter) -> OpenIGTLinkTracker | None:
    """The tracker that the file describes, or None without one or after an error."""
    device = draft.devices.get("tracker")
    if device is None or device.address.value is None:
        return None
    if not reporter.obeys(hardware.address(device.address.value), device.address.span):
        return None
    return OpenIGTLinkTracker(*hardware.host_and_port(device.address.value), device.name)
