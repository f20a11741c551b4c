"""An example of every message, with every field set, made from its type: the same one each time.

A value depends on the name of its field, so that two fields that change places are noticed.
"""

from typing import Any, Final
from zlib import crc32

import msgspec
from msgspec import inspect

from swarm.messages import Message
from swarm.messages.schema import kinds

KINDS: Final = kinds()


def example_of(kind: type[Message]) -> Message:
    """Return the example of a message."""
    example: Message = msgspec.convert(_value(inspect.type_info(kind), kind.__name__), kind)
    return example


def _value(type_: inspect.Type, name: str) -> Any:  # noqa: ANN401
    """Return a value that a type allows, as builtins; ``name`` is that of the field."""
    match type_:
        case inspect.Metadata(type=inner):
            return _value(inner, name)
        case inspect.FloatType(ge=low, gt=above):
            least = low if low is not None else above if above is not None else 0.0
            return max(0.0, least) + (1 + crc32(name.encode()) % 15) / 64
        case inspect.IntType(ge=low, le=high):
            least = max(low or 0, 0)
            return least + crc32(name.encode()) % (100 if high is None else min(100, high - least + 1))
        case inspect.StrType(pattern=pattern):
            return name if pattern is not None else f"{name} of r1"
        case inspect.BytesType():
            return name.encode()
        case inspect.BoolType():
            return True
        case inspect.EnumType(cls=cls):
            return list(cls)[-1].value
        case inspect.LiteralType(values=values):
            return values[0]
        case (
            inspect.ListType(item_type=item, min_length=least) | inspect.VarTupleType(item_type=item, min_length=least)
        ):
            return [_value(item, f"{name}{place}") for place in range(max(2, least or 0))]
        case inspect.TupleType(item_types=items):
            return [_value(item, f"{name}{place}") for place, item in enumerate(items)]
        case inspect.DictType(key_type=key, value_type=value):
            return {_value(key, name): _value(value, name)}
        case inspect.UnionType(types=types):
            return _value(next(one for one in types if not isinstance(one, inspect.NoneType)), name)
        case inspect.NamedTupleType(fields=fields):
            return [_value(field.type, field.name) for field in fields]
        case inspect.StructType(fields=fields, tag_field=tag_field, tag=tag):
            tagged = {} if tag_field is None else {tag_field: tag}
            return tagged | {field.encode_name: _value(field.type, field.encode_name) for field in fields}
    raise TypeError(f"no example for {type_}")
