"""A simulated lab: everything that `ntagen drive` needs, without hardware, in another process.

A needle in tissue stands behind an emulated stepper controller on a pseudo-terminal, and a tracker
and a force sensor publish it over OpenIGTLink. To the driver all of that is real: it opens a port,
connects to a server, and time passes by itself. The lab alone knows the truth.
"""
