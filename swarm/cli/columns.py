"""Rows of text in columns. Nothing is cut: people copy what they read."""

from collections.abc import Collection, Sequence


def align_rows(rows: Sequence[Sequence[str]], right: Collection[int] = ()) -> str:
    """Return rows of equally many cells as lines; the columns with the numbers ``right`` end flush.

    >>> print(align_rows([("key", "Hz"), ("robot/r1/cmd", "20.0"), ("world/clock", "1.0")], right=[1]))
    key             Hz
    robot/r1/cmd  20.0
    world/clock    1.0
    """
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join(
        "  ".join(
            cell.rjust(width) if number in right else cell.ljust(width)
            for number, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    )
