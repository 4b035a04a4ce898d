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
    """The tables of every part of the house: each ``app/*/tables.py`` and ``app/*/…_tables.py`` is imported first."""
    import app

    for part in pkgutil.iter_modules(app.__path__, "app."):
        if part.ispkg:
            for module in pkgutil.iter_modules(import_module(part.name).__path__):
                if module.name == "tables" or module.name.endswith("_tables"):
                    import_module(f"{part.name}.{module.name}")
    return Base.metadata
