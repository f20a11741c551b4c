"""Any bytes make a loader return a map or raise an error of one sentence; earlier findings of the fuzzer are kept."""

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.maps.drawings import FILES, hand_made_png, mended, png, read


def damaged(content: bytes, draw: random.Random) -> bytes:
    """Damage a file as transfers, editors and strangers do: cut, swap, repeat, insert, set bytes."""
    whole = bytearray(content)
    for _ in range(draw.choice((1, 1, 1, 2, 4))):
        at, span = draw.randint(0, len(whole)), draw.randint(1, 8)
        match draw.randint(0, 6):
            case 0:
                del whole[at:]
            case 1:
                del whole[at : at + span]
            case 2:
                whole[at:at] = whole[at : at + span] * draw.randint(1, 3)
            case 3:
                whole[at:at] = bytes(draw.randrange(256) for _ in range(span))
            case 4:
                whole[at:at] = draw.choice(WORDS)
            case 5:
                whole[at : at + span] = draw.choice(WORDS)
            case _:
                whole[at : at + 1] = bytes([draw.randrange(256)])
    return mended(bytes(whole)) if whole.startswith(b"\x89PNG") and draw.random() < 0.7 else bytes(whole)


WORDS = (
    *(b"-1", b"0", b"1e999", b"nan", b"999999999", b"99999999999999999999", b"\n", b"\r\n", b"\t", b" ", b"#", b": "),
    *(
        b"[",
        b"]",
        b"{",
        b"&a",
        b"*a",
        b"!!python/object:os.system",
        b"2001-99-99",
        b"0x",
        b"<<: *a",
        b"? ",
        b"- ",
        b"--- ",
    ),
    *(
        b"map",
        b"type",
        b"height",
        b"P2",
        b"P5",
        b"\x00",
        b"\xff\xfe",
        b"\xef\xbb\xbf",
        "é\N{FULLWIDTH DIGIT ONE}".encode(),
    ),
)

FOUND = {
    "an image of 16 bits a colour": ("image", hand_made_png(1, 1, 16, 2, b"\0" * 7)),
    "a bit depth that is none": ("image", hand_made_png(1, 1, 3, 0, b"\0\0")),
    "a colour kind that is none": ("image", hand_made_png(1, 1, 8, 5, b"\0\0")),
    "a palette that is not there": ("image", hand_made_png(2, 1, 8, 3, b"\0\0\1")),
    "fewer pixels than promised": ("image", hand_made_png(9, 9, 8, 0, b"\0\0")),
    "a picture of no width": ("image", hand_made_png(0, 9, 8, 0, b"")),
    "a picture of four thousand million pixels": ("image", hand_made_png(65_535, 65_535, 8, 0, b"")),
    "a picture without pixels": ("image", mended(png().replace(b"IDAT", b"IDQT"))),
    "a header and no more": ("image", png()[:33]),
    "the first eight bytes": ("image", png()[:8]),
    "PGM sizes that multiply past the limit": ("image", b"P5 16000 16000 255 "),
    "PGM without a brightest value": ("image", b"P5 1 1 0 \x00"),
    "PGM numbers with a sign": ("image", b"P2 1 1 9 -1"),
    "PGM digits of another script": ("image", "P2 1 1 9 \N{ARABIC-INDIC DIGIT ONE}".encode()),
    "very deep YAML": ("yaml", b"[" * 5000),
    "very deep keys": ("yaml", b"? " * 3000),
    "a date that is none": ("yaml", b"image: 2001-99-99"),
    "YAML that repeats itself": ("yaml", b"&a [*a]"),
    "a list as a key": ("yaml", b"? [image]\n: map.pgm"),
    "no YAML at all": ("yaml", b""),
    "a tag to run": ("yaml", b"image: !!python/object/apply:os.system [true]"),
    "height written twice": ("movingai", b"height 1\nheight 1\nwidth 1\nmap\n."),
    "a million rows promised": ("movingai", b"height 999999\nwidth 999999\nmap\n."),
    "superscript digits": ("movingai", "height ²\nwidth 1\nmap\n.".encode()),
    "a lone surrogate": ("text", b"#\xff"),
    "a length that overflows": ("scen", b"0\tx\t4\t2\t0\t0\t1\t1\t1e999"),
}


@pytest.mark.parametrize(("kind", "content"), FOUND.values(), ids=FOUND)
def test_found_before(kind: str, content: bytes) -> None:
    if kind == "image" and content == FOUND["an image of 16 bits a colour"][1]:
        assert read(kind, content)
    else:
        assert not read(kind, content)


@pytest.mark.parametrize("kind", FILES)
def test_whole_files_are_read(kind: str) -> None:
    assert all(read(kind, content) for content in FILES[kind])


@given(kind=st.sampled_from(sorted(FILES)), seed=st.integers(0, 2**32))
def test_damaged_files_are_read_or_refused(kind: str, seed: int) -> None:
    draw = random.Random(seed)
    read(kind, damaged(draw.choice(FILES[kind]), draw))


@given(
    kind=st.sampled_from(sorted(FILES)),
    content=st.binary(max_size=200) | st.text(max_size=100).map(lambda t: t.encode("utf-8", "surrogatepass")),
)
def test_any_bytes_are_read_or_refused(kind: str, content: bytes) -> None:
    read(kind, content)
