"""Makes the shapes of regions from files, in the frame of the scene."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Final, cast

from ntagen.nsl.diagnostics import Reporter
from ntagen.nsl.draft import Draft, DraftImage, DraftRegion, Placed
from ntagen.nsl.reading import located
from ntagen.nsl.source import Span
from ntagen.shapes import Field, Shape

if TYPE_CHECKING:
    from ntagen.imaging.grid import Wish
    from ntagen.imaging.nifti import Matrix
    from ntagen.imaging.space import Rigid, Space

_FILE_BYTES: Final = 512 * 2**20


class ImageBuilder:
    """Reads files of anatomy, and reports what is wrong with them."""

    def __init__(self, draft: Draft, reporter: Reporter) -> None:
        self._draft = draft
        self._reporter = reporter

    def is_placed(self) -> bool:
        """Whether the transform has no mistake; one that has is reported."""
        return self._draft.transform is None or self._imaging is not None

    def field(self, draft: DraftRegion, wish: Wish) -> Field | None:
        """The field of a mesh or a part of a segmentation; None after a mistake."""
        from ntagen.imaging.mistakes import ImageError

        image = draft.image
        path = None if image is None or not self.is_placed() else self._path(image.path)
        if image is None or path is None:
            return None
        if image.grid_mm is not None:
            wish = replace(wish, step_mm=image.grid_mm.value)
        try:
            return self._kept(image, path, wish)
        except ImageError as error:
            self._report(error, image.path.span)
            return None

    def _kept(self, image: DraftImage, path: str, wish: Wish) -> Field | None:
        """The field, which is computed only once for all runs with the same file."""
        from ntagen.imaging.segmentations import files_of
        from ntagen.imaging.store import kept

        if image.form == "mesh":
            # Before anything else of a large file is read.
            from ntagen.imaging.meshes import refuse_large

            refuse_large(path)
        said = (image.part, image.matrix, image.space, image.unit_mm)
        key = (
            _digest([path] if image.form == "mesh" else files_of(path)),
            image.form,
            *(None if one is None else one.value for one in said),
            self._imaging,
            wish,
        )

        def make() -> Field:
            made = self._made(image, path, wish)
            if made is None:
                raise _ReportedError
            return made

        try:
            return kept(key, make)
        except _ReportedError:
            return None

    def _made(self, image: DraftImage, path: str, wish: Wish) -> Field | None:
        if image.form == "mesh":
            from ntagen.imaging.meshes import read_mesh
            from ntagen.imaging.surfaces import field_of_mesh

            mesh = read_mesh(path)
            motion = self._motion(image, mesh.space, path)
            unit_mm = self._unit(image, None, path, mesh.space)
            if motion is None or unit_mm is None:
                return None
            placed = replace(mesh, vertices=motion.points(mesh.vertices * unit_mm))
            return field_of_mesh(placed, wish, path)
        from ntagen.imaging.segmentations import Part, read_mask
        from ntagen.imaging.voxels import field_of_mask

        part = None if image.part is None else image.part.value
        matrix = None if image.matrix is None else cast("Matrix", image.matrix.value)
        mask = read_mask(
            path,
            Part(segment=part, matrix=matrix)
            if isinstance(part, str)
            else Part(label=cast("int", part), matrix=matrix),
        )
        motion = self._motion(image, mask.space, path, mask.said)
        unit_mm = self._unit(image, mask.unit_mm, path, mask.space)
        if motion is None or unit_mm is None:
            return None
        return field_of_mask(mask, motion, unit_mm, wish)

    def marks(self, draft: DraftRegion) -> list[tuple[str, Shape]]:
        """The shapes of a file of markups, with the names of their regions; none after a mistake.

        One shape alone has the region's own name; several have numbers from 1: ``Marks[1]``.
        """
        from ntagen.imaging.markups import read_marks
        from ntagen.imaging.mistakes import ImageError

        image = draft.image
        path = None if image is None or not self.is_placed() else self._path(image.path)
        if image is None or path is None:
            return []
        radius_mm = None if image.radius_mm is None else image.radius_mm.value
        point = None if image.part is None else str(image.part.value)
        shapes: list[Shape] = []
        try:
            for mark in read_marks(path, radius_mm, point):
                motion = self._motion(image, mark.space, path)
                if motion is None:
                    return []
                shapes.append(mark.shape.placed(motion.axes, motion.shift_mm))
        except ImageError as error:
            self._report(error, image.path.span)
            return []
        if len(shapes) == 1:
            return [(draft.name, shapes[0])]
        return [(f"{draft.name}[{i}]", shape) for i, shape in enumerate(shapes, 1)]

    # ------------------------------------------------------------------------------------- frames

    @cached_property
    def _imaging(self) -> tuple[Space, Rigid] | None:
        """The space of the transform, and the motion from it to the frame of the scene."""
        from ntagen.imaging.mistakes import ImageError
        from ntagen.imaging.space import rigid
        from ntagen.imaging.transforms import read_transform

        draft = self._draft.transform
        if draft is None:
            return None
        space = cast("Space", draft.space.value)
        path = None if draft.file is None else self._path(draft.file)
        if draft.file is not None and path is None:
            return None
        try:
            if path is None:
                motion = rigid(draft.rows, "this matrix")
            else:
                motion, said = read_transform(path)
                if said is not None and said != space:
                    raise ImageError(
                        "space-unknown",
                        f"`{path}` is in {said} by its standard, and this says {space}",
                        f"write `{said}`",
                    )
        except ImageError as error:
            self._report(error, draft.span)
            return None
        return space, motion if draft.is_from else motion.inverse()

    def _motion(
        self, image: DraftImage, said: Space | None, path: str, word: str | None = None
    ) -> Rigid | None:
        """From the space of a file to the frame of the scene; None after a mistake.

        Args:
            image: The region.
            said: The space of the coordinates that were read, if the file says it.
            path: The file.
            word: What the file says of its space, if it is not that name.
        """
        from ntagen.imaging.space import between

        written = None if image.space is None else image.space.value
        if said is None and written is None:
            self._reporter.report(
                "space-unknown",
                image.path.span,
                f"nothing says whether `{path}` is in LPS or in RAS"
                + (f"; it says `space: {word}`" if word is not None else ""),
                hint="look it up where the file was made, and write `in LPS` or `in RAS`",
            )
            return None
        if said is not None and written is not None and (word is not None or said != written):
            span = image.path.span if image.space is None else image.space.span
            self._reporter.report(
                "space-unknown",
                span,
                f"`{path}` says that it is in {word or said}, and this says {written}",
                hint=f"write `in {said}`, or nothing"
                if word is None
                else f"leave out `{written}`; what is in {word} is brought to {said}",
            )
            return None
        if self._draft.transform is None:
            if not self._draft.has_gaps:
                self._reporter.report(
                    "transform-missing",
                    image.path.span,
                    "nothing says where imaging space lies in the frame of this file",
                    hint="write for example `transform from LPS (1, 0, 0, 0 mm), (0, 1, 0, 0 mm),"
                    " (0, 0, 1, 0 mm)`, if tip and heading are in LPS",
                )
            return None
        if self._imaging is None:
            return None
        space, motion = self._imaging
        return motion.after(between(cast("Space", said or written), space))

    def _unit(
        self, image: DraftImage, said_mm: float | None, path: str, said: Space | None
    ) -> float | None:
        """How many mm one unit of a file is; None after a mistake.

        Args:
            image: The region.
            said_mm: The unit of the file, if it says it.
            path: The file.
            said: The space of the file, if it says it; the hint leaves it out then.
        """
        written = image.unit_mm
        if written is None or written.value is None:
            if said_mm is None:
                self._reporter.report(
                    "unit-unknown",
                    image.path.span,
                    f"nothing says in which unit `{path}` is",
                    hint="look it up where the file was made, and write for example `in "
                    + ("mm`" if said else f"{image.space.value if image.space else 'LPS'} mm`"),
                )
            return said_mm
        if said_mm is not None and said_mm != written.value:
            self._reporter.report(
                "unit-unknown",
                written.span,
                f"`{path}` says that its unit is {said_mm:g} mm, and this says"
                f" {written.value:g} mm",
                hint="leave the unit out",
            )
            return None
        return written.value

    # -------------------------------------------------------------------------------------- files

    def _path(self, placed: Placed[str]) -> str | None:
        """The path of a file, if it may be read; it begins at the folder of the description."""
        folders, named = self._draft.folders, placed.value or ""
        found = located(named, placed.span, folders, self._reporter, "read")
        return None if found is None else found[0]

    def _report(self, error: Exception, span: Span) -> None:
        from ntagen.imaging.mistakes import ImageError

        if not isinstance(error, ImageError):
            raise error
        self._reporter.report(error.defect, span, error.message, hint=error.hint)


def _digest(paths: list[str]) -> str:
    """A name for the content of files that no other content has.

    Raises:
        ImageError: One cannot be read.
    """
    import hashlib

    from ntagen.imaging.reading import bytes_of

    return hashlib.sha256(
        "".join(hashlib.sha256(bytes_of(path, _FILE_BYTES)).hexdigest() for path in paths).encode()
    ).hexdigest()


class _ReportedError(Exception):
    """A mistake that is reported already."""
