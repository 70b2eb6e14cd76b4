"""Data as JSON text and back, exactly: how work and its results travel between processes.

Numbers come back bit for bit. Arrays go as their bytes, shapes as WKB, layers column by column,
and dataclasses of this library as their fields; nothing else is ever made of what is read, so
that a text from elsewhere can do no harm.
"""

from __future__ import annotations

import base64
import dataclasses
import datetime
import importlib
import json
from collections.abc import Mapping
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import shapely
from pyproj import CRS

#: The package of the library, whatever its name is here.
ROOT = __name__.rsplit(".", 2)[0]
#: Dates and times; pandas has classes of its own, which are no others but a date and time.
_DATES = (datetime.date, datetime.time, type(pd.NaT))
_READ = {
    "date": datetime.date.fromisoformat,
    "time": datetime.time.fromisoformat,
    "datetime": datetime.datetime.fromisoformat,
    "Timestamp": pd.Timestamp,
}


def to_text(value: Any) -> str:
    """Return a value as one line of JSON.

    Parameters
    ----------
    value
        Nothing, numbers, texts, dates and times, bytes, lists, tuples, mappings, NumPy arrays,
        Shapely shapes, coordinate reference systems, layers and tables, and dataclasses of this
        library of such.

    Raises
    ------
    TypeError
        It holds something else, or itself.

    Examples
    --------
    >>> from_text(to_text({1: (0.1, float("inf"))}))
    {1: (0.1, inf)}
    """
    return json.dumps(_Packer().pack(value), separators=(",", ":"))


def from_text(text: str) -> Any:
    """Return the value that `to_text` wrote."""
    return _Unpacker().unpack(json.loads(text))


class _Packer:
    """Turns values into what JSON has; a dataclass that is met again is only named."""

    def __init__(self) -> None:
        self._numbers: dict[int, int] = {}
        self._within: set[int] = set()

    def pack(self, value: Any) -> Any:
        """Return a value as JSON has it."""
        if value is None or isinstance(value, (bool, int, float, str)):
            return value.item() if isinstance(value, np.generic) else value
        if isinstance(value, np.generic):
            return self.pack(value.item())
        if isinstance(value, list):
            return [self.pack(one) for one in value]
        if isinstance(value, tuple) and not hasattr(value, "_fields"):
            return {"tuple": [self.pack(one) for one in value]}
        if isinstance(value, Mapping):
            return {"map": [[self.pack(k), self.pack(v)] for k, v in value.items()]}
        if isinstance(value, _DATES):
            # what is no time at all is of the class of none of them
            kind = "none" if value is pd.NaT else type(value).__name__
            return {"date": [kind, "" if value is pd.NaT else value.isoformat()]}
        if isinstance(value, bytes):
            return {"bytes": base64.b64encode(value).decode("ascii")}
        if isinstance(value, np.ndarray):
            return self._array(value)
        if isinstance(value, shapely.Geometry):
            return {"shape": shapely.to_wkb(value, hex=True, include_srid=False)}
        if isinstance(value, CRS):
            return {"crs": _crs_text(value)}
        if isinstance(value, pd.DataFrame):
            return self._table(value)
        if dataclasses.is_dataclass(value) and type(value).__module__.startswith(f"{ROOT}."):
            return self._object(value)
        msg = f"{type(value).__name__} cannot be handed to another process"
        raise TypeError(msg)

    def _array(self, value: np.ndarray[Any, Any]) -> Any:
        if value.dtype.kind not in "biufcSU":
            return {"objects": [list(value.shape), [self.pack(one) for one in value.flat]]}
        data = base64.b64encode(np.ascontiguousarray(value).tobytes()).decode("ascii")
        return {"array": [value.dtype.str, list(value.shape), data]}

    def _table(self, value: pd.DataFrame) -> Any:
        columns = [[self.pack(name), self._column(value[name])] for name in value.columns]
        index = [*self._column(value.index.to_series()), self.pack(value.index.name)]
        shape = None
        if isinstance(value, gpd.GeoDataFrame) and value.active_geometry_name is not None:
            shape = [value.active_geometry_name, self.pack(value.crs)]
        return {"table": [columns, index, shape]}

    def _column(self, column: pd.Series) -> Any:
        """Return a column: its kind, and its values."""
        values = np.asarray(column.array, dtype=object)
        if column.dtype.kind in "biuf" and isinstance(column.dtype, np.dtype):
            values = column.to_numpy()
        return [str(column.dtype), self._array(values)]

    def _object(self, value: Any) -> Any:
        key = id(value)
        if key in self._within:
            msg = f"{type(value).__name__} holds itself"
            raise TypeError(msg)
        if key in self._numbers:
            return {"same": self._numbers[key]}
        self._within.add(key)
        fields = {
            field.name: self.pack(getattr(value, field.name))
            for field in dataclasses.fields(value)
            if field.init
        }
        self._within.remove(key)
        self._numbers[key] = len(self._numbers)
        kind = type(value)
        return {"object": [f"{kind.__module__[len(ROOT) :]}:{kind.__qualname__}", fields]}


class _Unpacker:
    """Makes values of what JSON has."""

    def __init__(self) -> None:
        self._made: list[Any] = []

    def unpack(self, value: Any) -> Any:
        """Return the value that was packed."""
        if isinstance(value, list):
            return [self.unpack(one) for one in value]
        if not isinstance(value, dict):
            return value
        ((kind, inner),) = value.items()
        made: Any
        if kind == "tuple":
            made = tuple(self.unpack(one) for one in inner)
        elif kind == "map":
            made = {self.unpack(k): self.unpack(v) for k, v in inner}
        elif kind == "date":
            made = _date(*inner)
        elif kind == "bytes":
            made = base64.b64decode(inner)
        elif kind in ("array", "objects"):
            made = self._array(value)
        elif kind == "shape":
            made = shapely.from_wkb(inner)
        elif kind == "crs":
            made = CRS.from_user_input(inner)
        elif kind == "table":
            made = self._table(*inner)
        elif kind == "same":
            made = self._made[inner]
        else:
            made = self._object(*inner)
        return made

    def _array(self, value: dict[str, Any]) -> np.ndarray[Any, Any]:
        if "objects" in value:
            shape, items = value["objects"]
            found = np.empty(len(items), dtype=object)
            found[:] = [self.unpack(one) for one in items]
            return found.reshape(shape)
        kind, shape, data = value["array"]
        # a copy, since what is read from bytes cannot be changed
        return np.frombuffer(base64.b64decode(data), dtype=kind).reshape(shape).copy()

    def _table(self, columns: list[Any], index: Any, shape: Any) -> pd.DataFrame:
        places = pd.Index(self._column(*index[:2]), name=self.unpack(index[2]))
        made = {self.unpack(name): self._column(*column) for name, column in columns}
        if shape is None:
            return pd.DataFrame(made, index=places)
        return gpd.GeoDataFrame(made, index=places, geometry=shape[0], crs=self.unpack(shape[1]))

    def _column(self, kind: str, values: Any) -> Any:
        array = self._array(values)
        if kind == "geometry":
            return gpd.array.GeometryArray(array)
        return pd.array(array, dtype=kind) if "objects" in values else array

    def _object(self, name: str, fields: dict[str, Any]) -> Any:
        made = dataclass_of(name)(**{key: self.unpack(value) for key, value in fields.items()})
        self._made.append(made)
        return made


def dataclass_of(name: str) -> Any:
    """Return the dataclass of this library that a name such as ".site.types:Site" means.

    Raises
    ------
    TypeError
        There is none of that name.
    """
    module, _, path = name.partition(":")
    found: Any = None
    if module.startswith(".") and not module.startswith(".."):
        found = importlib.import_module(f"{ROOT}{module}")
        for part in path.split("."):
            found = getattr(found, part, None)
    if not (isinstance(found, type) and dataclasses.is_dataclass(found)):
        msg = f"{name} is no dataclass of this library"
        raise TypeError(msg)
    return found


def _date(kind: str, text: str) -> Any:
    """Return the date or time that a text means."""
    return pd.NaT if kind == "none" else _READ[kind](text)


def _crs_text(crs: CRS) -> str:
    """Return a short text where one says all, else the whole definition."""
    found = crs.to_authority(min_confidence=100)
    short = f"{found[0]}:{found[1]}" if found else ""
    return short if short and CRS.from_user_input(short) == crs else str(crs.to_wkt())
