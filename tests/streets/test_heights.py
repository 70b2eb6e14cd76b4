"""Heights of a raster at any place and in any CRS."""

from __future__ import annotations

import numpy as np
import pytest
from platwright.streets import HeightGrid
from pyproj import Transformer


def plane(rows=8, columns=10, step=10.0, crs="EPSG:25832"):
    """Heights that rise by 0.1 per unit to the east and 0.2 to the north."""
    x = 500_000 + step * (np.arange(columns) + 0.5)
    y = 5_800_000 - step * (np.arange(rows) + 0.5)
    values = 0.1 * (x - 500_000)[None, :] + 0.2 * (y - 5_800_000)[:, None]
    return HeightGrid(values, 500_000.0, 5_800_000.0, step, step, crs)


def test_a_plane_is_a_plane_between_the_cells():
    rng = np.random.default_rng(1)
    places = np.column_stack(
        [rng.uniform(500_005, 500_095, 50), rng.uniform(5_799_925, 5_799_995, 50)]
    )
    found = plane().seen_from("EPSG:25832")(places)
    assert found == pytest.approx(0.1 * (places[:, 0] - 500_000) + 0.2 * (places[:, 1] - 5_800_000))


def test_another_crs_is_turned_to_that_of_the_raster():
    turn = Transformer.from_crs("EPSG:25832", "EPSG:4326", always_xy=True)
    lon, lat = turn.transform(500_050.0, 5_799_960.0)
    found = plane().seen_from("EPSG:4326")(np.array([[lon, lat]]))
    assert found == pytest.approx([0.1 * 50 - 0.2 * 40], abs=1e-4)


def test_outside_and_holes_are_unknown():
    grid = plane()
    grid.values[3, 4] = np.nan
    at = grid.seen_from("EPSG:25832")
    assert np.isnan(at(np.array([[499_000.0, 5_799_960.0], [500_045.0, 5_799_965.0]]))).all()


def test_a_raster_of_one_cell_has_one_height():
    grid = HeightGrid(np.array([[7.0]]), 0.0, 10.0, 10.0, 10.0, "EPSG:25832")
    assert grid.seen_from("EPSG:25832")(np.array([[6.0, 4.0]])) == pytest.approx([7.0])
