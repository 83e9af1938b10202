"""Maps of ROS's ``map_server`` as obstacles: a YAML file and an image.

    image: office.pgm              # in this file's folder or below it; PGM or PNG
    resolution: 0.05               # metres per pixel
    origin: [-10.0, -10.0, 0.0]    # pose in map of the image's lower left corner
    negate: 0
    occupied_thresh: 0.65
    free_thresh: 0.196
    mode: trinary                  # or scale, raw; trinary if left out

Occupied cells become boxes as high as the scene's walls. Cells are read as ``map_server`` reads
them (``image_loader.cpp``). They are obstacles where ``costmap_2d``'s static layer with its
default parameters has a lethal cost, see ``occupancy_of``.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, List, Optional, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.errors import InputError
from quad_nav.files.document import Checker, describe
from quad_nav.files.user_files import referenced_file
from quad_nav.geometry import Pose2D
from quad_nav.sim.map_image import Pixels, read_pixels
from quad_nav.sim.obstacles import Box

Cells = NDArray[np.int8]

FREE, OCCUPIED, UNKNOWN = 0, 100, -1
MAX_BOXES = 200_000
MIN_RESOLUTION_M, MAX_RESOLUTION_M = 1e-3, 100.0
_RECTANGLES_AT_ONCE = 65_536
_KEYS = ["image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh", "mode"]
_MODES = ("trinary", "scale", "raw")
_NEGATE = {0: False, 1: True}  # also False and True, which are equal to them


@dataclass(frozen=True)
class MapFields:
    """Content of the YAML file.

    Attributes:
        image: Path of the image.
        resolution_m: Size of a cell.
        origin: Pose in ``map`` of the image's lower left corner.
        negate: Dark pixels are free instead of occupied.
        occupied_thresh: Occupancy, 0 to 1, above which a cell is occupied.
        free_thresh: Occupancy, 0 to 1, below which a cell is free.
        mode: trinary, scale or raw; see ``occupancy_of``.
    """

    image: Path
    resolution_m: float
    origin: Pose2D
    negate: bool
    occupied_thresh: float
    free_thresh: float
    mode: str


@dataclass(frozen=True)
class MapFile:
    """Content of a map's YAML file and image.

    Attributes:
        fields: Content of the YAML file.
        occupancy: int8[H, W], row 0 at the lower edge; 0 free, 100 occupied, -1 unknown.
        remarks: Notes for the user on what map_server reads otherwise.
    """

    fields: MapFields
    occupancy: Cells
    remarks: Tuple[str, ...] = ()

    def occupied(self, unknown_too: bool) -> NDArray[np.bool_]:
        """Return the mask bool[H, W] of occupied cells, with unknown ones if asked."""
        occupied: NDArray[np.bool_] = self.occupancy >= OCCUPIED
        return occupied | (self.occupancy == UNKNOWN) if unknown_too else occupied

    def is_free(self, x_m: NDArray[np.float64], y_m: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return whether the cells at points in ``map``, float64[n], are known to be free."""
        right_m, up_m = self.fields.origin.inverse_transform(x_m, y_m)
        columns = np.floor(right_m / self.fields.resolution_m).astype(int)
        rows = np.floor(up_m / self.fields.resolution_m).astype(int)
        height, width = self.occupancy.shape
        inside = (rows >= 0) & (rows < height) & (columns >= 0) & (columns < width)
        found = self.occupancy[rows.clip(0, height - 1), columns.clip(0, width - 1)]
        free: NDArray[np.bool_] = inside & (found >= FREE) & (found < OCCUPIED)
        return free

    def corners(self) -> List[Tuple[float, float]]:
        """Return the image's four corners in ``map``."""
        height, width = self.occupancy.shape
        return [self._in_map(x, y) for x in (0.0, width) for y in (0.0, height)]

    def _in_map(self, column: float, row: float) -> Tuple[float, float]:
        resolution_m = self.fields.resolution_m
        return self.fields.origin.transform(column * resolution_m, row * resolution_m)

    def boxes(self, height_m: float, unknown_too: bool) -> List[Box]:
        """Cover the occupied cells, unknown ones too if asked, with few disjoint boxes.

        Raises:
            InputError: There are more than ``MAX_BOXES`` boxes.
        """
        rectangles = rectangles_of(self.occupied(unknown_too)).tolist()
        if len(rectangles) > MAX_BOXES:
            problem = f"occupied cells make {len(rectangles)} boxes, expected {MAX_BOXES} at most"
            advice = "remove isolated pixels from the image"
            raise InputError([f"{self.fields.image}: {problem} ({advice})"])
        resolution_m, yaw_rad = self.fields.resolution_m, self.fields.origin.yaw_rad
        boxes = []
        for number, (column, row, width, height) in enumerate(rectangles):
            centre = self._in_map(column + width / 2, row + height / 2)
            sizes = (width * resolution_m, height * resolution_m, height_m)
            boxes.append(Box(f"map_{number}", *centre, *sizes, yaw_rad))
        return boxes


def load_map(document: Any, path: Path) -> MapFile:
    """Check the parsed document of a map's YAML file and read the image.

    Raises:
        InputError: The document or the image has faults; lists all of them.
    """
    check = Checker(str(path))
    fields = _read_fields(check, document, path.parent)
    if check.problems or fields is None:
        raise InputError(check.problems)
    pixels = read_pixels(fields.image, fields.mode == "trinary")
    remarks = [f"{fields.image}: {pixels.remark}"] if pixels.remark else []
    if fields.image != path.parent / document["image"]:
        remarks.append(f"{path}: image: {document['image']} is not here, {fields.image} is used")
    remarks += [
        f"{path}: {key}: ignored, map_server has no such key"
        for key in document
        if key not in _KEYS
    ]
    return MapFile(fields, occupancy_of(pixels, fields), tuple(remarks))


def occupancy_of(pixels: Pixels, fields: MapFields) -> Cells:
    """Return the occupancy int8[H, W] of pixels as ``map_server`` reads them.

    With p = (255 - value) / 255, or value / 255 if negated, a cell is occupied (100) above
    ``occupied_thresh``, free (0) below ``free_thresh``, and unknown (-1) between them. In mode
    scale, cells between the thresholds are 1 to 99, which is not an obstacle, or unknown if the
    pixel is transparent. In mode raw the value itself is the occupancy: 100 to 254 are obstacles,
    255 is unknown. Row 0 is the image's last row.
    """
    values = np.arange(255 * pixels.channels + 1) / pixels.channels
    if fields.negate:
        values = 255.0 - values
    cells = _cells_of(values, fields)[pixels.sums]
    if fields.mode == "scale":
        between = (cells != FREE) & (cells != OCCUPIED)
        cells[between & ~pixels.opaque] = UNKNOWN
    return np.ascontiguousarray(cells[::-1])


def _cells_of(values: NDArray[np.float64], fields: MapFields) -> Cells:
    """Return the cells int8[n] of opaque pixels with mean values float64[n], 0 to 255."""
    if fields.mode == "raw":
        raw = np.floor(values)
        return np.where(raw >= 255, UNKNOWN, np.minimum(raw, OCCUPIED)).astype(np.int8)
    p = (255.0 - values) / 255.0
    occupied, free = p > fields.occupied_thresh, p < fields.free_thresh
    between = np.full(p.shape, float(UNKNOWN))
    if fields.mode == "scale" and fields.occupied_thresh > fields.free_thresh:
        span = fields.occupied_thresh - fields.free_thresh
        between = np.clip(1.0 + 98.0 * (p - fields.free_thresh) / span, 1.0, 99.0)
    return np.select([occupied, free], [OCCUPIED, FREE], between).astype(np.int8)


def rectangles_of(marked: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Cover the true cells of bool[H, W], and no others, with few disjoint rectangles.

    Returns:
        int64[n, 4]: first column, first row, width and height in cells.
    """
    from quad_nav.sim.rectangles import cover  # here: scenes load without numba otherwise

    left = marked.copy()
    parts, row = [], 0
    while row < len(left):
        part = np.empty((_RECTANGLES_AT_ONCE, 4), np.int64)
        count, row = cover(left, part, row)
        parts.append(part[:count])
    return np.concatenate(parts)


def _read_fields(check: Checker, document: Any, folder: Path) -> Optional[MapFields]:
    if not isinstance(document, dict):
        check.fault("", f"{describe(document)}, expected a mapping with {', '.join(_KEYS)}")
        return None
    image = check.text(document, "image", "", "")
    resolution_m = check.number(document, "resolution", "", positive=True)
    origin = Pose2D(*check.numbers(document, "origin", "", 3))
    negate = document.get("negate")
    if not isinstance(negate, int) or negate not in _NEGATE:
        check.fault("negate", f"{describe(negate)}, expected 0 or 1")
    occupied, free = (
        _threshold(check, document, key) for key in ("occupied_thresh", "free_thresh")
    )
    if free > occupied:
        check.fault("free_thresh", f"{free:g} is above occupied_thresh, {occupied:g}")
    mode = document.get("mode", "trinary")
    if not isinstance(mode, str) or mode not in _MODES:
        check.fault("mode", f"{describe(mode)}, expected {', '.join(_MODES)}")
    if not MIN_RESOLUTION_M <= resolution_m <= MAX_RESOLUTION_M:
        check.fault(
            "resolution",
            f"{resolution_m:g} m, expected {MIN_RESOLUTION_M:g} to {MAX_RESOLUTION_M:g}",
        )
    return MapFields(
        _image_path(check, folder, image), resolution_m, origin, bool(negate), occupied, free, mode
    )


def _image_path(check: Checker, folder: Path, image: str) -> Path:
    beside = folder / Path(image).name  # map_saver writes absolute paths of its machine
    if Path(image).is_absolute() and not Path(image).exists() and beside.is_file():
        return beside
    try:
        return referenced_file(folder, image)
    except InputError as error:
        check.fault("image", "; ".join(error.problems))
        return folder


def _threshold(check: Checker, document: Any, key: str) -> float:
    value = check.number(document, key, "")
    if not 0.0 <= value <= 1.0:
        check.fault(key, f"{value:g}, expected a share from 0 to 1")
    return value
