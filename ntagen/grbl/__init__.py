"""Steppers that speak GRBL 1.1 or grblHAL: the protocol, a driver, and an emulator to try it with.

`protocol` and `names` know what the controller says. `port` is the wire, `link` the rules of the
conversation, and `actuator` moves the needle. `emulator` stands for a controller where there is no
hardware: `planner` moves its axes, `gcode` reads its lines, `dialects` holds what differs between
the two firmwares, and `pseudo` puts it on a pseudo-terminal.
"""
