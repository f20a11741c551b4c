"""What msgspec finds wrong with values, in this project's form: where, what was expected, what came."""

import re
import reprlib
from typing import Any, Final, NamedTuple

import msgspec

from swarm.errors import suggest
from swarm.messages.fields import ID_PATTERN

ID_IN_WORDS: Final = "1 to 64 letters, digits or _ . : -"
SHORT: Final = reprlib.Repr()  # aliases in YAML can make a value that would take years to print
SHORT.maxlevel, SHORT.maxstring, SHORT.maxother = 3, 60, 60


class Mistake(NamedTuple):
    """One fault of some values."""

    where: str  # such as "targets[0].x"; "" if it is about all of them
    names: list[str]  # of the fields on the way there
    said: str  # by msgspec, without the place
    value: object  # what is there

    def __str__(self) -> str:
        """Return the fault as a part of a sentence."""
        said = self.said.replace("`", "").replace(f"str matching regex {ID_PATTERN!r}", ID_IN_WORDS)
        if not said.startswith(("Object ", "Invalid enum")):  # those name what came, or what is missing
            said = f"{said.replace('Expected', 'expected').split(', got')[0]}, got {quote_value(self.value)}"
        return f"{self.where}{': ' * bool(self.where)}{said}"


def explain_fault(fault: str, raw: object) -> Mistake:
    """Return the fault that msgspec names in some plain values.

    >>> print(explain_fault("Expected `float` >= 0.0 - at `$.targets[1]`", {"targets": [1.0, -2.0]}))
    targets[1]: expected float >= 0.0, got -2.0
    """
    said, _, at = fault.partition(" - at ")
    steps = re.findall(r"\.(\w+)|\[(\d+)\]", at.strip("`"))
    value: Any = raw
    for name, index in steps:
        try:
            value = value[name] if name else value[int(index)]
        except (KeyError, IndexError, TypeError):
            break
    where = "".join(f".{name}" if name else f"[{index}]" for name, index in steps).lstrip(".")
    return Mistake(where, [name for name, _ in steps if name], said, value)


def quote_value(value: object) -> str:
    """Return a value as text, cut to 60 characters."""
    text = SHORT.repr(value[:60] if isinstance(value, bytes) else value)
    return text if len(text) <= 60 else text[:57] + "..."


def in_words(fault: str, raw: object, kind: type[msgspec.Struct]) -> str:
    """Return the fault that msgspec finds in a file's values, which should be those of a type, and what to do."""
    where, names, said, value = wrong = explain_fault(fault, raw)
    section, unit = _find_description(names, kind)
    if match := re.match(r"Object contains unknown field `(.*)`", said):
        prefix = f"{where}: " if where else ""
        return f"{prefix}unknown field {match[1]!r}; {suggest(match[1], section.__struct_fields__)}"
    if match := re.match(r"Object missing required field `(.*)`", said):
        return f"{where + ': ' if where else ''}field {match[1]!r} is missing; add it"
    hint = f" ({unit})" if unit else ""
    if isinstance(value, str) and ("float" in said or "int" in said):
        hint += "; write the bare number, without a unit"
    return f"{wrong}{hint}"


def _find_description(names: list[str], section: type[msgspec.Struct]) -> tuple[type[msgspec.Struct], str]:
    """Return the section that a path of names leads to from another one, and the last field's description."""
    text = ""
    for name in names:
        info = {f.name: f.type for f in msgspec.inspect.type_info(section).fields}.get(name)  # type: ignore[attr-defined]
        while info is not None and not isinstance(info, msgspec.inspect.StructType):
            if isinstance(info, msgspec.inspect.Metadata):
                text = (info.extra_json_schema or {}).get("description", text)
                info = info.type
            else:
                break
        if isinstance(info, msgspec.inspect.StructType):
            section = info.cls
    return section, text
