"""Images of maps: how bright and how opaque each pixel is."""

import re
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

PNG: Final = b"\x89PNG\r\n\x1a\n"
HEADER: Final = re.compile(rb"(P[25])" + rb"(?:\s|#[^\r\n]*[\r\n])+?([0-9]{1,9})" * 3)
COMMENT: Final = re.compile(rb"#[^\r\n]*")
PLAIN_MAX: Final = 4_000_000  # bytes of the pixels of a P2
NO_NUMBER: Final = re.compile(rb"\S*[^\s0-9]\S*|[0-9]{10,}")
BRIGHTEST: Final = 65_535


class Pixels(NamedTuple):
    """An image, its first row at the top."""

    brightness: NDArray[np.float64]  # (rows, columns), 0 black to 1 white, the mean of the colours
    opacity: NDArray[np.float64] | None  # (rows, columns), 0 to 1; None where the image has none


def load_image(path: Path) -> Pixels:
    """Load a PGM (P2 or P5) or a PNG; the first bytes tell which.

    Raises:
        ConfigError: the file cannot be read, is not such an image, is broken, or is too large.
    """
    return from_image(read_file(path), str(path))


def from_image(content: bytes, where: str = "image") -> Pixels:
    """Read the bytes of a PGM (P2 or P5) or a PNG.

    Raises:
        ConfigError: the bytes are not such an image, or it is broken or too large.
    """
    if content.startswith(PNG):
        return _png(content, where)
    if content[:2] in (b"P2", b"P5"):
        return _pgm(content, where)
    raise ConfigError(
        f"{where}: expected an image, PGM (P2 or P5) or PNG, got {content[:8]!r} at its beginning; convert it to PNG"
    )


def _pgm(content: bytes, where: str) -> Pixels:
    """Read netpbm's greyscale format: https://netpbm.sourceforge.net/doc/pgm.html."""
    header = HEADER.match(content)
    if not header:
        raise ConfigError(f"{where}: expected a PGM header 'P5 WIDTH HEIGHT MAXVAL', got another; export it again")
    columns, rows, brightest = (int(number) for number in header.groups()[1:])
    check_size(rows, columns, where)
    if not 0 < brightest <= BRIGHTEST:
        raise ConfigError(f"{where}: expected a brightest value of 1 to {BRIGHTEST}, got {brightest}; export it again")
    body = content[header.end() :]
    if not body[:1].isspace():
        raise ConfigError(f"{where}: expected pixels after the PGM header, got {body[:8]!r}; is the file whole?")
    count = rows * columns
    if header[1] == b"P5":
        kind = np.dtype(np.uint8 if brightest < 256 else ">u2")
        size = count * kind.itemsize
        body = body[1:]
        if len(body) < size or body[size:].strip():
            raise ConfigError(
                f"{where}: expected {size} bytes for {columns} x {rows} pixels, got {len(body)}; is the file whole?"
            )
        values = np.frombuffer(body, kind, count).astype(np.float64)
    else:
        if len(body) > PLAIN_MAX:
            raise ConfigError(
                f"{where}: expected at most {PLAIN_MAX} bytes of pixels written as numbers (P2), got {len(body)}; "
                "save it as P5 or PNG"
            )
        plain = COMMENT.sub(b" ", body)
        bad = NO_NUMBER.search(plain)
        values = np.empty(0) if bad else np.fromstring(plain, np.float64, sep=" ")
        if bad or len(values) != count:
            got = f"{bad[0][:20]!r}" if bad else f"{len(values)}"
            raise ConfigError(
                f"{where}: expected {count} numbers for {columns} x {rows} pixels, got {got}; is it whole?"
            )
    if values.max() > brightest:
        raise ConfigError(f"{where}: expected no pixel above {brightest}, got {values.max():.0f}; export it again")
    return Pixels(values.reshape(rows, columns) / brightest, None)


def _png(content: bytes, where: str) -> Pixels:
    # check the size, which is the first field of a PNG, before anything is unpacked
    if len(content) < 33 or content[12:16] != b"IHDR":
        raise ConfigError(f"{where}: expected a PNG header, got a broken one; export it again")
    columns, rows = int.from_bytes(content[16:20], "big"), int.from_bytes(content[20:24], "big")
    check_size(rows, columns, where)
    if content[25] == 3 and b"PLTE" not in content:
        raise ConfigError(f"{where}: expected a PNG with its palette, got none; export it again")
    from PIL import Image  # a robot, which gets its map from the world, does without

    try:
        with Image.open(BytesIO(content), formats=["PNG"]) as image:
            image.verify()  # checksums and the end of the file: pillow's load() checks neither
        with Image.open(BytesIO(content), formats=["PNG"]) as image:
            has_alpha = "A" in image.getbands() or "transparency" in image.info
            if image.mode.startswith("I"):  # 16 bits of grey
                return Pixels(np.asarray(image, np.float64) / BRIGHTEST, None)
            bands = np.asarray(image.convert("RGBA" if has_alpha else "RGB"))
    except (OSError, SyntaxError, ValueError, EOFError, IndexError, OverflowError, StructError, zlib.error) as error:
        reason = " ".join(str(error).split())[:80]
        raise ConfigError(f"{where}: expected a whole PNG, got a broken one ({reason}); export it again") from error
    return Pixels(bands[:, :, :3].sum(axis=2, dtype=np.uint16) / 765, bands[:, :, 3] / 255 if has_alpha else None)
