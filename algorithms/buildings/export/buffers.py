"""The numbers of a glTF file: one buffer, with views of it."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

#: Codes of glTF: types of numbers, and what a view is for.
FLOAT, UNSIGNED_INT = 5126, 5125
ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963


class Buffers:
    """Collects arrays.

    Attributes
    ----------
    data
        All bytes so far.
    views, accessors
        What of it is what, as glTF declares it.
    """

    def __init__(self) -> None:
        self.data = bytearray()
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []

    def primitive(
        self,
        points: npt.NDArray[np.float64],
        normals: npt.NDArray[np.float64],
        triangles: npt.NDArray[np.int64],
        material: int,
    ) -> dict[str, Any]:
        """Add triangles of one material, and give what a mesh says of them.

        Parameters
        ----------
        points, normals
            Shape (n, 3).
        triangles
            Shape (m, 3), indices of points.
        material
            Its index.
        """
        return {
            "attributes": {
                "POSITION": self._vectors(points, True),
                "NORMAL": self._vectors(normals),
            },
            "indices": self._indices(triangles),
            "material": material,
        }

    def _vectors(self, values: npt.NDArray[np.float64], bounds: bool = False) -> int:
        """Add vectors of three numbers; of positions glTF asks for the bounds."""
        single = values.astype("<f4")
        told: dict[str, Any] = {"componentType": FLOAT, "count": len(single), "type": "VEC3"}
        if bounds:
            told["min"], told["max"] = single.min(axis=0).tolist(), single.max(axis=0).tolist()
        return self._add(single.tobytes(), ARRAY_BUFFER, told)

    def _indices(self, triangles: npt.NDArray[np.int64]) -> int:
        """Add indices of points."""
        told = {"componentType": UNSIGNED_INT, "count": int(triangles.size), "type": "SCALAR"}
        return self._add(triangles.astype("<u4").tobytes(), ELEMENT_ARRAY_BUFFER, told)

    def _add(self, data: bytes, target: int, told: dict[str, Any]) -> int:
        """Add bytes, of which each number has four, and return the index of the accessor."""
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data)}
        self.views.append({**view, "target": target})
        self.data += data
        self.accessors.append({"bufferView": len(self.views) - 1, **told})
        return len(self.accessors) - 1
