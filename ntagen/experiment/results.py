"""What a campaign gives: the table as plain data, as a frame, and in files."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from ntagen.errors import InputError
from ntagen.experiment.report import report_of
from ntagen.experiment.table import FORMAT_VERSION
from ntagen.experiment.writing import csv_of, flat, latex_of, markdown_of
from ntagen.files import MODEL_BYTES, json_of, read_file, write_files
from ntagen.frames import frame_of
from ntagen.scene import Scene

FILES = ("table.json", "table.csv", "table.md", "table.tex", "report.html")
"""The files that `Campaign.write` writes."""


@dataclass(frozen=True, slots=True)
class Campaign:
    """A finished campaign.

    Attributes:
        document: All of it, as ``table.json`` has it.
        folder: Its folder, with the logs.
        scenes: The scene of each row, by the name of the row.
        sections: The sections of the report that are drawn already, by the name of the row.
    """

    document: Mapping[str, Any]
    folder: Path
    scenes: Mapping[str, Scene]
    sections: Mapping[str, str] = field(default_factory=dict)

    @property
    def table(self) -> list[dict[str, Any]]:
        """The rows, as plain data (`ntagen.experiment.table.row_of`)."""
        return list(self.document["rows"])

    @property
    def runs(self) -> list[dict[str, Any]]:
        """The runs, as plain data (`ntagen.experiment.record.Run`)."""
        return list(self.document["runs"])

    def to_frame(self) -> Any:  # noqa: ANN401  it depends on what is installed
        """The rows as a frame of pandas, or of polars if there is no pandas.

        Raises:
            InputError: Neither is installed.
        """
        rows = [flat(row) for row in self.table]
        return frame_of(rows, "`table` has the rows")

    def _repr_html_(self) -> str:
        from ntagen.experiment.report import table_of

        return table_of(self.document)

    def write(self) -> None:
        """Writes `FILES` into the folder; each is written whole or not at all.

        Raises:
            InputError: They cannot be written.
        """
        texts = (
            json.dumps(self.document, indent=1, allow_nan=False) + "\n",
            csv_of(self.document),
            markdown_of(self.document),
            latex_of(self.document),
            report_of(self.document, self.scenes, self.sections),
        )
        write_files({self.folder / name: text for name, text in zip(FILES, texts, strict=True)})


_MOST_VALUES: Final = 4_000_000
"""A table may have so many values: some ten thousand runs."""


def read_table(folder: Path) -> Campaign:
    """A campaign from the table in its folder; its scenes are not known.

    Raises:
        InputError: There is no such table.
    """
    path = folder / "table.json"
    try:
        document = json_of(read_file(path, MODEL_BYTES), _MOST_VALUES)
        if document["format"] != FORMAT_VERSION:
            raise InputError(f"{path} has the format {document['format']}, not {FORMAT_VERSION}")
    except (OSError, ValueError, KeyError, RecursionError, TypeError) as error:
        raise InputError(f"{path} is no table of an experiment: {error}") from error
    return Campaign(document, folder, {})
