"""Anatomy from files: meshes, segmentations and markups of imaging, as shapes.

Nothing here knows of scenes or of the environment language. Coordinates that come out of the
readers are in mm in the space that a file is in, LPS (to the left, to the back, to the head) or RAS
(to the right, to the front, to the head); `ntagen.imaging.space` brings them into another frame.

Only this room uses nibabel, which is optional: see `ntagen.imaging.nifti`.

No file makes a reader take more than 512 MiB of memory beyond its own size: what a header claims is
checked before anything is made of it, and what is packed is unpacked in pieces.
"""
