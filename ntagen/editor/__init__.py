"""Environments in editors: a language server for ``.nsl``.

``language`` answers what an editor asks about a text; ``server`` speaks the language server
protocol, for which it needs the extra ``editor``.
"""
