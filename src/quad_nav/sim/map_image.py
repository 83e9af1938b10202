"""Images of maps as arrays; the only module of ``sim`` that imports pillow."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Callable, Tuple, TypeVar

import numpy as np
from numpy.typing import NDArray
from PIL import Image, UnidentifiedImageError

from quad_nav.errors import InputError
from quad_nav.files.user_files import open_file
from quad_nav.files.values import memory_problem

MAX_CELLS = 10_000 * 10_000
MAX_BYTES = 512 * 1024 * 1024
_BYTES_PER_PIXEL = {"1": 7, "L": 6, "LA": 12, "RGB": 10, "RGBA": 12, "I;16": 9, "I;16B": 9, "I": 13}
_MOST_BYTES_PER_PIXEL = 13
"""Memory of an image's pixels, sums and occupancy while a map is read, measured."""
_FORMATS = ("PPM", "PNG")  # PPM includes PGM
_FORMATS_OF_STAGE = (*_FORMATS, "BMP", "GIF", "JPEG")
_NAMES = {"PPM": "PGM"}
_LIGHTEST_DARK = 127
_AS_SDL_LOADS = {"1": "L", "LA": "RGBA"}
"""Modes of images that map_server's SDL_image loads with other channels."""
PALETTE_REMARK = (
    "has a palette: its colours are used as they look, but map_server uses their numbers in the "
    "palette; expected a grey image for map_server"
)
_Read = TypeVar("_Read")


@dataclass(frozen=True)
class Pixels:
    """Pixels of an image; row 0 is the uppermost.

    Attributes:
        sums: uint16[H, W], sums over the channels, each of them 0 to 255.
        channels: Number of channels.
        opaque: bool[H, W], false where a pixel is transparent to map_server: where the last of
            several channels is 0, blue too.
        remark: Note for the user on how map_server reads the image; "" for nearly all.
    """

    sums: NDArray[np.uint16]
    channels: int
    opaque: NDArray[np.bool_]
    remark: str = ""


def read_pixels(path: Path, alpha_counts: bool) -> Pixels:
    """Read an image.

    Args:
        path: A PGM or PNG file.
        alpha_counts: Count alpha as one of the channels.

    Raises:
        InputError: The file is not a PGM or PNG image, is damaged, or is too large.
    """
    return _read(path, _FORMATS, lambda image: _pixels(image, alpha_counts))


def read_dark(path: Path) -> NDArray[np.bool_]:
    """Read where an image of Stage is dark, bool[H, W]; row 0 is the lowest.

    As in libstage/stage.cc, the first channel counts alone, up to 127.

    Raises:
        InputError: As ``read_pixels``.
    """
    first = _read(
        path, _FORMATS_OF_STAGE, lambda image: np.asarray(image.convert("RGB"))[::-1, :, 0]
    )
    return first <= _LIGHTEST_DARK


def _read(path: Path, formats: Tuple[str, ...], convert: Callable[[Image.Image], _Read]) -> _Read:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)  # MAX_CELLS is ours
            with open_file(path, MAX_BYTES) as file, Image.open(file, formats=formats) as image:
                _check_size(path, image)
                return convert(image)
    except UnidentifiedImageError:
        *most, last = (_NAMES.get(one, one) for one in formats)
        raise InputError([f"{path}: is not a {', '.join(most)} or {last} image"]) from None
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        raise InputError([f"{path}: cannot be read: {error}"]) from error


def _check_size(path: Path, image: Image.Image) -> None:
    width, height = image.size
    if not 0 < width * height <= MAX_CELLS:
        raise InputError(
            [f"{path}: is {width} x {height} pixels, expected 1 to {MAX_CELLS:g} pixels"]
        )
    each = _BYTES_PER_PIXEL.get(image.mode, _MOST_BYTES_PER_PIXEL)
    problem = memory_problem(
        width, height, "pixels", each, "8 bits of grey take least; or a smaller or coarser map"
    )
    if problem:
        raise InputError([f"{path}: {problem}"])
    if image.mode == "F":
        raise InputError([f"{path}: has pixels with fractions, expected PGM or PNG"])


def _pixels(image: Image.Image, alpha_counts: bool) -> Pixels:
    remark = ""
    if image.mode == "P":
        # SDL_image shows map_server the colours only if several are transparent.
        has_colours = isinstance(image.info.get("transparency"), bytes)
        numbers, image = image, image.convert("RGBA" if has_colours else "RGB")
        if not has_colours and (np.asarray(numbers)[:, :, None] != np.asarray(image)).any():
            remark = PALETTE_REMARK
    image = image.convert(_AS_SDL_LOADS.get(image.mode, image.mode))
    array = np.asarray(image)
    if array.dtype != np.uint8:  # 16 bits per channel, of which the upper 8 are used
        array = (array.astype(np.uint32) >> 8).astype(np.uint8)
    channels = array if array.ndim == 3 else array[:, :, None]
    count = channels.shape[2]
    opaque = channels[:, :, -1] > 0 if count > 1 else np.ones(channels.shape[:2], bool)
    counted = channels if alpha_counts or count < 4 else channels[:, :, :-1]
    return Pixels(counted.sum(axis=2, dtype=np.uint16), counted.shape[2], opaque, remark)
