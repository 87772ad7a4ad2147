"""OpenIGTLink, the network protocol of trackers and image-guided devices: codec, client, server.

Versions 1 to 3 of the protocol are read and written (openigtlink.org/developers/spec.html). The
code is our own: it shares nothing with the libraries with which the tests compare it. The room
knows nothing of needles; `ntagen.tracking` makes measurements of needles from the messages.
"""
