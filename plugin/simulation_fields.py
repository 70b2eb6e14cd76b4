"""The layers that `simulatetraffic` writes; see `fields`."""

from __future__ import annotations

from .fields import Field, LayerKind

SIMULATED_STREETS = LayerKind(
    "streets",
    "Simulated traffic",
    "LineString",
    (
        Field("length_m", "number", "length in metres"),
        Field("flow_veh_h", "number", "vehicles per hour, both directions, mean over the length"),
        Field("flow_ahead", "number", "of these, along the line"),
        Field("flow_back", "number", "of these, against the line"),
        Field("travel_kmh", "number", "mean speed in km/h; empty where nothing travelled"),
        Field("waiting_s", "number", "mean seconds that a vehicle stands on the street"),
        Field("loss_s", "number", "mean seconds that a vehicle loses on it against driving freely"),
    ),
    "simulated_streets",
    like="INPUT",
    renewed=("length_m",),
)
