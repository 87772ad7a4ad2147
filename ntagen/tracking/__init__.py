"""Trackers: what measures a needle that really exists, in the coordinates of the scene.

All trackers follow `ntagen.drive.device.Sensor`. `spec` reads the words of ``--tracker``; `live`
listens to an OpenIGTLink server, `playback` repeats a recorded run. `registration` fits the
transform from a tracker's coordinates to those of the scene, from pairs of points.
"""
