"""Environments, models and queries in editors: a language server.

`language` answers what an editor asks about the text of an environment, `names`, `completing` and
`renaming` about that of a model; `server` speaks the language server protocol, for which it needs
the extra ``editor``.
"""
