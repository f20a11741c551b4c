"""Images of maps: how bright and how opaque each pixel is. Pillow reads them."""

import zlib
from io import BytesIO
from pathlib import Path
from struct import error as StructError  # noqa: N812
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm.errors import ConfigError
from swarm.maps.files import read_file
from swarm.maps.limits import check_size

FORMATS: Final = ("PNG", "PPM", "BMP")  # PPM is all of netpbm: PGM too
BEGINNINGS: Final = (b"\x89PNG\r\n\x1a\n", b"P2", b"P5", b"P3", b"P6", b"BM")
BRIGHTEST: Final = 65_535
BROKEN: Final = (OSError, SyntaxError, ValueError, EOFError, IndexError, OverflowError, StructError, zlib.error)


class Pixels(NamedTuple):
    """An image, its first row at the top."""

    brightness: NDArray[np.float64]  # (rows, columns), 0 black to 1 white, the mean of the colours
    opacity: NDArray[np.float64] | None  # (rows, columns), 0 to 1; None where the image has none


def load_image(path: Path) -> Pixels:
    """Load a PGM, PNG or BMP; the first bytes tell which.

    Raises:
        ConfigError: the file cannot be read, is not such an image, is broken, or is too large.
    """
    return from_image(read_file(path), str(path))


def from_image(content: bytes, where: str = "image") -> Pixels:
    """Read the bytes of a PGM, PNG or BMP.

    Raises:
        ConfigError: the bytes are not such an image, or it is broken or too large.
    """
    from PIL import Image  # a robot, which gets its map from the world, does without

    if not content.startswith(BEGINNINGS):
        raise ConfigError(
            f"{where}: expected an image, PGM, PNG or BMP, got {content[:8]!r} at its beginning; convert it to PNG"
        )
    try:
        with Image.open(BytesIO(content), formats=FORMATS) as image:  # reads the header only
            columns, rows = image.size
            check_size(rows, columns, where)
            image.verify()  # checksums and the end of a PNG: pillow's load() checks neither
        with Image.open(BytesIO(content), formats=FORMATS) as image:
            if image.mode == "P" and image.palette is None:
                raise ValueError("it has no palette")
            has_alpha = "A" in image.getbands() or "transparency" in image.info
            if image.mode.startswith("I"):  # 16 bits of grey
                return Pixels(np.asarray(image, np.float64) / BRIGHTEST, None)
            bands = np.asarray(image.convert("RGBA" if has_alpha else "RGB"))
    except Image.DecompressionBombError as error:
        raise ConfigError(f"{where}: expected a smaller image ({error}); cut the map, or draw it coarser") from None
    except BROKEN as error:
        reason = " ".join(str(error).split())[:80]
        raise ConfigError(f"{where}: expected a whole image, got a broken one ({reason}); export it again") from error
    return Pixels(bands[:, :, :3].sum(axis=2, dtype=np.uint16) / 765, bands[:, :, 3] / 255 if has_alpha else None)
