"""Reading what a process prints."""

import subprocess


def await_line(process: "subprocess.Popen[str]", *words: str) -> str:
    """Read what a process prints until a line has all words, and return that."""
    assert process.stdout is not None
    said = []
    for line in process.stdout:
        said.append(line)
        if all(word in line for word in words):
            return line
    raise AssertionError(f"{words}: {''.join(said)}")
