"""In place of UPPAAL's command-line checker: its options, output, and files.

Scripts and programs that call ``verifyta`` find here what they rely on. What is known of that comes
from public clients and logs; ``docs/verifyta.md`` says what is the same and what differs.

``trace`` is the model by numbers, and a symbolic trace in these numbers. ``compiled``, ``xtr``,
``trace_xml`` and ``trace_text`` write them as files and text. ``options`` reads the
command line, ``output`` has the lines that are printed, ``places`` the places of mistakes. Nothing
here prints.
"""
