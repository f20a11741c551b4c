"""What a run takes place on, as it crosses the wire: the packed map, the scenario's settings, the fuzzy profile."""

from typing import Annotated, Literal

from msgspec import UNSET, Meta, Struct, UnsetType

from swarm.messages.fields import Angle, Id, Length, Metres, doc
from swarm.settings import Settings

Name = Annotated[str, Meta(pattern=r"^\w{1,40}\Z")]
Place = Annotated[float, Meta(ge=-1e7, le=1e7)]
Bounded = Annotated[float, Meta(ge=-1e100, le=1e100)]
Corner = Bounded | Literal["-inf", "inf"]


class PackedMap(Struct, frozen=True, kw_only=True):
    """A map: a grid of square cells, each wall, obstacle, free or unknown."""

    rows: Annotated[int, Meta(ge=1, le=2**32, description="number of rows")]
    columns: Annotated[int, Meta(ge=1, le=2**32, description="number of columns")]
    resolution: Annotated[Length, doc("m; side of a cell")]
    origin: Annotated[
        tuple[Place, Place, Place],
        doc("m, m, rad; pose of the grid in the map: its outer corner at row 0, column 0; columns run along its x"),
    ]
    cells: Annotated[
        bytes,
        doc(
            "one byte a cell, compressed with zlib: rows from the bottom up, each from x = 0 on; "
            "0 free, 1 wall, 2 obstacle, 3 unknown"
        ),
    ]


class VariableOnWire(Struct, frozen=True, kw_only=True):
    """A variable of the fuzzy controller."""

    unit: Annotated[Literal["m", "m/s", "degrees"], doc("of all its numbers")]
    universe: Annotated[tuple[Bounded, Bounded], doc("least and greatest value; others are clipped to them")]
    terms: Annotated[
        dict[Name, tuple[Corner, Corner, Corner, Corner]],
        doc("trapezoid a, b, c, d of each term: 0 up to a, 1 from b to c, 0 from d on; `-inf`, `inf`: a shoulder"),
    ]


class WeighingOnWire(Struct, frozen=True, kw_only=True):
    """How two behaviours share the wheels; see fuzzy.md."""

    behaviour: Annotated[Name, doc("the behaviour of weight w")]
    yields_to: Annotated[Name, doc("the behaviour of weight 1 - w")]
    when: Annotated[dict[Name, Name], doc("term of each input; w is the least of 1 - membership in them")]


class SlowingOnWire(Struct, frozen=True, kw_only=True):
    """How both wheels slow down with the nearest of the three distances."""

    near: Annotated[Length, doc("m; at it and below, speeds are multiplied by `least`")]
    far: Annotated[Length, doc("m; from it on, speeds are the tables'")]
    least: Annotated[float, Meta(ge=0, le=1, description="the least factor")]


class ProfileOnWire(Struct, frozen=True, kw_only=True):
    """A fuzzy profile: the rules that steer our robots. Other robots need not look at it."""

    name: Annotated[str, doc("its name")]
    description: Annotated[str, doc("for people")] = "-"
    inputs: Annotated[dict[Name, VariableOnWire], doc("`left_obs`, `front_obs`, `right_obs`, `head_ang`")]
    outputs: Annotated[dict[Name, VariableOnWire], doc("`left_v`, `right_v`")]
    behaviours: Annotated[
        dict[Name, str], doc("rules of each: a line with the names of the columns, then one rule a line")
    ]
    weighing: Annotated[WeighingOnWire | Literal["none"], doc("`none`: there is one behaviour")] = "none"
    slowing: Annotated[SlowingOnWire | UnsetType, doc("left out: the speeds stay as they are")] = UNSET


class ScenarioOnWire(Struct, frozen=True, kw_only=True):
    """A scenario without its map."""

    settings: Annotated[
        Settings,
        doc(
            "as in a scenario file, with all defaults; here an unknown field is refused; in a Welcome `robot`, "
            "`sensors` and `controller` are those of the robot's kind"
        ),
    ]
    profile: Annotated[ProfileOnWire, doc("the fuzzy controller; in a Welcome that of the robot's kind")]
    starts: Annotated[
        dict[Id, tuple[Metres, Metres, Angle]] | UnsetType,
        doc("m, m, rad; start of each robot, by name; only in a Map: a Welcome has the start of the robot itself"),
    ] = UNSET
    kinds: Annotated[
        dict[Id, Id] | UnsetType, doc("the kind of each robot, by name; only in a Map of a fleet with kinds")
    ] = UNSET
    profiles: Annotated[
        dict[Id, ProfileOnWire] | UnsetType,
        doc("the fuzzy controllers that kinds have of their own, by kind; left out: none has one"),
    ] = UNSET
