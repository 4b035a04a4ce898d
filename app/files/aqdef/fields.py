"""The K fields of AQDEF files that are read or written here: one table, by Hexagon's list of version 12.

Any other field of a value is kept as it is written, by its number; any other of the description is not used.
"""

from typing import NamedTuple


class Field(NamedTuple):
    """A K field.

    unit: of a number; K2142 is the unit that this field names. most: characters that it holds, which longer texts are cut to.
    read: what it becomes here; "" if it is kept by its number, or not used. written: what fills it; "" if it is not written, or
    as it came. row: its place in a line for all characteristics is that among the fields with one. holds: there, and below it,
    it holds on until another value is said. ours: filled by the reading, so that a sender's own is not written beside it.
    """

    meaning: str
    unit: str = ""
    most: int = 255
    read: str = ""
    written: str = ""
    row: bool = False
    holds: bool = False
    ours: bool = False


FIELDS = {
    # Of a value
    "K0001": Field("value", unit="K2142", read="measured", written="corrected size", row=True, ours=True),
    "K0002": Field("attribute", read="excluded unless 0", written="validity", row=True, ours=True),
    "K0004": Field(
        "time", unit="wall clock", read="measured_at", written="measured_at", row=True, holds=True, ours=True
    ),
    "K0005": Field("events", read="events", written="events", row=True),
    "K0006": Field("batch", most=40, read="batch", written="batch", row=True, holds=True),
    "K0007": Field("nest", read="nest", written="nest", row=True, holds=True),
    "K0008": Field("operator", read="operator", written="operator", row=True, holds=True),
    "K0009": Field("text", read="comment", written="comment"),
    "K0010": Field("machine", read="machine", written="machine", row=True, holds=True),
    "K0011": Field("process parameters", read="process", written="process", row=True),
    "K0012": Field("gauge", read="gauge", written="gauge", row=True, holds=True),
    "K0014": Field("part", most=40, read="part", written="part", ours=True),
    "K0015": Field("purpose"),
    "K0016": Field("production number"),
    "K0017": Field("workpiece carrier"),
    "K0020": Field("sample size"),
    "K0021": Field("number of faults"),
    "K0053": Field("order", most=20, read="order", written="order", ours=True),
    **{f"K00{number}": Field("further field") for number in range(54, 64)},
    "K0080": Field("further field"),
    "K0081": Field("further field"),
    "K0097": Field("GUID", written="plant and number of the reading", ours=True),
    # Of a part
    "K1001": Field("part number", most=30, read="part", written="part"),
    "K1002": Field("part name", most=80, read="part", written="part"),
    "K1081": Field("machine number", most=24, read="machine", written="key of the machine"),
    "K1082": Field("machine name", most=40, read="machine", written="name of the machine"),
    "K1085": Field("place", most=40, written="place"),
    "K1086": Field("operation", most=40, written="operation"),
    # Of a characteristic
    "K2001": Field("number", most=20, read="number", written="key"),
    "K2002": Field("name", most=80, read="name", written="name"),
    "K2004": Field("kind", read="counts: refused", written="0: measured"),
    "K2005": Field("importance", written="importance"),
    "K2022": Field("decimal places", written="decimals"),
    "K2060": Field("catalogue of events", written="1 where there are any"),
    "K2061": Field("catalogue of process parameters", written="1 where there are any"),
    "K2101": Field("nominal size", unit="K2142", read="nominal", written="nominal"),
    "K2110": Field("lower limit", unit="K2142", read="lower", written="lower"),
    "K2111": Field("upper limit", unit="K2142", read="upper", written="upper"),
    "K2112": Field("lower deviation", unit="K2142", read="lower", written="lower - nominal"),
    "K2113": Field("upper deviation", unit="K2142", read="upper", written="upper - nominal"),
    "K2120": Field("kind of the lower limit", read="natural_limit", written="natural_limit"),
    "K2121": Field("kind of the upper limit", read="natural_limit", written="natural_limit"),
    "K2142": Field("unit", most=20, read="unit", written="unit"),
    "K2402": Field("gauge", most=40, written="probe of the machine"),
    # Of catalogues
    "K4062": Field("machine number", most=40, read="machine", written="key of the machine"),
    "K4063": Field("machine name", most=100, read="machine", written="name of the machine"),
    "K4072": Field("gauge number", most=40, read="gauge", written="key of the machine"),
    "K4073": Field("gauge name", most=80, read="gauge", written="probe of the machine"),
    "K4092": Field("operator", most=50, read="operator", written="operator"),
    "K4093": Field("operator", most=50, read="operator", written="operator"),
    "K4222": Field("event number", most=40, read="events", written="its number"),
    "K4223": Field("event", most=100, read="events", written="event"),
    "K4242": Field("process parameter number", most=40, read="process", written="its number"),
    "K4243": Field("process parameter", most=100, read="process", written="process parameter"),
    # Of the tree, by the numbers of nodes: characteristics and nodes below one, the part and the characteristic that it is
    "K5102": Field("characteristics below a node", read="part"),
    "K5103": Field("nodes below a node", read="part"),
    "K5111": Field("part of a node", read="part"),
    "K5112": Field("characteristic of a node", read="part"),
}
OF_VALUES = {key: field for key, field in FIELDS.items() if key.startswith("K00")}
ROW = tuple(key for key, field in FIELDS.items() if field.row)


class Catalogue(NamedTuple):
    """A catalogue that values name entries of by number: its own field, and those of a short and of a long text."""

    key: str
    name: str
    short: str
    long: str


CATALOGUES = {
    "K0010": Catalogue("K4060", "machines", "K4062", "K4063"),
    "K0012": Catalogue("K4070", "gauges", "K4072", "K4073"),
    "K0008": Catalogue("K4090", "operators", "K4092", "K4093"),
    "K0005": Catalogue("K4220", "events", "K4222", "K4223"),
    "K0011": Catalogue("K4240", "process parameters", "K4242", "K4243"),
}
"""By the field of the value, in the order in which they are written."""


def most_of(key: str) -> int:
    """Characters that a field holds."""
    return FIELDS[key].most if key in FIELDS else Field("").most
