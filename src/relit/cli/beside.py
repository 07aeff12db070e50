"""What `relit transfer` writes beside the result: a sheet, a mask of what changed, pictures of the stages."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from relit.cli.destinations import PictureFolder, check_apart
from relit.cli.options import check_streams
from relit.photo.writing import check_destination, write_image

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray

    from relit.photo.photo import Photo
    from relit.results import TransferResult


class Beside:
    """The files that were asked for, refused before any work goes into them; None is not wanted.

    `inputs` are the files that are read, and `output` is the result, which none of these may be.
    """

    def __init__(
        self,
        sheet: str | None,
        changed: str | None,
        stages: str | None,
        *,
        output: str,
        inputs: Iterable[str | None],
        force: bool,
        as_json: bool,
    ) -> None:
        self.sheet, self.changed, self._force = sheet, changed, force
        self._folder = None
        if stages is not None:
            from relit.figures import STAGES

            self._folder = PictureFolder(stages, [f"{name}.png" for name in (*STAGES, "sheet")], force)
        pictures = self._folder.files if self._folder else ()
        check_apart(output, {"--sheet": [sheet], "--changed": [changed], "--stages": pictures}, inputs)
        for picture in filter(None, (sheet, changed)):
            check_streams(picture, as_json)
            check_destination(picture, overwrite=force)

    def stages_of(self, result: TransferResult) -> dict[str, NDArray[Any]]:
        """Return the pictures of all stages by the names of their files, if they are wanted."""
        if self._folder is None:
            return {}
        from relit.figures import contact_sheet, stage_pictures

        pictures = stage_pictures(result)
        sheet = contact_sheet(result, pictures)
        return {f"{name}.png": picture for name, picture in (pictures | {"sheet": sheet}).items()}

    def write(
        self, results: Sequence[TransferResult], photo: Photo, pictures: dict[str, NDArray[Any]]
    ) -> list[str]:
        """Write all, of the results of a photo's faces and the pictures of stages; return their paths."""
        if self.sheet is not None:
            from relit.figures import comparison_sheet

            write_image(self.sheet, comparison_sheet(results[-1]), overwrite=self._force)
        if self.changed is not None:
            from relit.layering import before_and_after, changed_area

            where = changed_area(*before_and_after(results, photo))
            write_image(self.changed, where * np.uint8(255), overwrite=self._force)
        return self._folder.save(pictures) if self._folder else []
