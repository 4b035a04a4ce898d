"""The mapped base class: names of constraints that migrations can rely on, and what Python types become."""

import pkgutil
from datetime import datetime
from importlib import import_module
from types import MappingProxyType
from typing import Any, ClassVar

from sqlalchemy import Double, MetaData, Text
from sqlalchemy.dialects.postgresql import JSONB
from sqlalchemy.orm import DeclarativeBase

from app.db.types import UtcTime

NAMES = MappingProxyType(
    {
        "ix": "%(table_name)s_%(column_0_N_name)s_idx",
        "uq": "%(table_name)s_%(column_0_N_name)s_key",
        "ck": "%(table_name)s_%(constraint_name)s_check",
        "fk": "%(table_name)s_%(column_0_N_name)s_fkey",
        "pk": "%(table_name)s_pkey",
    }
)
"""PostgreSQL's own way of naming; a CHECK gives its middle part: ``name="order"`` becomes ``machine_order_check``."""


class Base(DeclarativeBase):
    metadata = MetaData(naming_convention=dict(NAMES))
    type_annotation_map: ClassVar[dict[Any, Any]] = {
        datetime: UtcTime,
        str: Text,
        float: Double,
        dict[str, Any]: JSONB,
        list[Any]: JSONB,
    }


def whole_metadata() -> MetaData:
    """Return the tables of every room: each module ``tables`` or ``…_tables`` and all of a folder ``tables`` is imported first."""
    import app

    for module in pkgutil.walk_packages(app.__path__, "app."):
        path = module.name.split(".")
        if path[-1].rpartition("_")[2] == "tables" or path[-2] == "tables":
            import_module(module.name)
    return Base.metadata
