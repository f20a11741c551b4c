"""Small map files of every kind, whole and broken, for the tests and the fuzzer."""

import struct
import zlib
from io import BytesIO

import numpy as np
from msgspec.structs import replace
from PIL import Image

from swarm.errors import ConfigError, PeerError
from swarm.maps.images import from_image
from swarm.maps.movingai import from_movingai, from_scen
from swarm.maps.occupancy import OccupancyMap
from swarm.maps.ros import from_yaml
from swarm.maps.text import from_text
from swarm.maps.wire import pack, unpack

TEXT = "####\n#.o#\n#  #\n####\n"
MOVINGAI = "type octile\nheight 3\nwidth 4\nmap\n..@.\nGTSW\n.O..\n"
SCEN = "version 1\n0\tx.map\t4\t2\t0\t0\t3\t1\t3.41421356\n1\tmaps/x.map\t0\t0\t0\t0\t0\t0\t0\n"
YAML = (
    "image: map.pgm\nmode: trinary\nresolution: 0.050000\norigin: [-10.0, 2.5e0, 0.3]\n"
    "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
)
P5 = b"P5\n# made by hand\n3 2\n255\n\x00\xcd\xfe\xff\xff\x00"
P5_WIDE = b"P5 2 1 1000\n\x03\xe8\x00\x00"
P2 = b"P2 # a comment\n3 2 # sizes\n255\n0 205 254\n255 255 0 # end\n"


def png(mode: str = "L", size: tuple[int, int] = (3, 2)) -> bytes:
    """Return the bytes of a small picture."""
    file = BytesIO()
    width, height = size
    Image.fromarray(np.arange(width * height, dtype=np.uint8).reshape(height, width) * 40).convert(mode).save(
        file, "PNG"
    )
    return file.getvalue()


def chunk(kind: bytes, content: bytes) -> bytes:
    """Return a chunk of a PNG with its right checksum."""
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))


def mended(content: bytes) -> bytes:
    """Return a damaged PNG with its chunks' checksums and lengths made right again, so that the damage gets further."""
    at, whole = 8, content[:8]
    while at + 12 <= len(content):
        size = min(int.from_bytes(content[at : at + 4], "big"), len(content) - at - 12)
        whole += chunk(content[at + 4 : at + 8], content[at + 8 : at + 8 + size])
        at += 12 + size
    return whole + content[at:]


def hand_made_png(width: int, height: int, depth: int, colour: int, pixels: bytes) -> bytes:
    """Return a PNG whose header says whatever it is told."""
    header = struct.pack(">IIBBBBB", width, height, depth, colour, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(pixels)) + chunk(b"IEND", b"")


SMALL = OccupancyMap(np.array([[0, 1, 2], [3, 0, 0]], np.uint8), 0.5)

FILES: dict[str, list[bytes]] = {
    "text": [TEXT.encode()],
    "movingai": [MOVINGAI.encode(), MOVINGAI.replace("\n", "\r\n").encode(), b"height 1\nwidth 1\nmap\n."],
    "scen": [SCEN.encode()],
    "yaml": [
        YAML.encode(),
        b"{image: a.png, resolution: 1, origin: [0, 0, 0], occupied_thresh: 0.6, free_thresh: 0.2}",
    ],
    "image": [P5, P5_WIDE, P2, *(png(mode) for mode in ("L", "RGB", "RGBA", "P", "1", "LA"))],
    "wire": [pack(SMALL).cells],
}


def read(kind: str, content: bytes) -> bool:
    """Let the loader of a kind read: True where it made something of it, False where it said why not.

    Anything but a sentence of ours is let through, for the caller to stumble over.
    """
    try:
        match kind:
            case "image":
                pixels = from_image(content)
                assert pixels.brightness.min() >= 0.0
                assert pixels.brightness.max() <= 1.0
            case "yaml":
                from_yaml(content)
            case "wire":
                assert unpack(replace(pack(SMALL), cells=content)).cells.max() <= 3
            case _:
                text = content.decode("utf-8", errors="surrogateescape")
                match kind:
                    case "text":
                        assert from_text(text, 0.5).cells.max() <= 3
                    case "movingai":
                        assert from_movingai(text).cells.max() <= 3
                    case "scen":
                        from_scen(text, OccupancyMap(np.zeros((2, 4), np.uint8), 1.0))
    except (ConfigError, PeerError) as error:
        sentence = str(error)
        assert any(word in sentence for word in ("expected", "unknown field", "is missing", "Invalid enum")), sentence
        assert "\n" not in sentence, sentence
        assert len(sentence) < 500, sentence
        return False
    return True
