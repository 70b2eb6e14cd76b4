"""The layers that the assignment of traffic writes; see `fields`."""

from __future__ import annotations

from .fields import Field, LayerKind

ASSIGNED_STREETS = LayerKind(
    "streets",
    "Traffic",
    "LineString",
    (
        Field("length_m", "number", "length in metres"),
        Field("flow_veh_h", "number", "vehicles per hour, both directions, mean over the length"),
        Field("flow_ahead", "number", "of these, along the line"),
        Field("flow_back", "number", "of these, against the line"),
        Field("through_veh_h", "number", "of these, on the way from gate to gate"),
        Field("time_s", "number", "seconds that a vehicle takes, mean of both directions by flow"),
        Field("free_kmh", "number", "speed on the free street, km/h"),
        Field("travel_kmh", "number", "speed with the traffic, km/h"),
        Field("v_c", "number", "volume / capacity of the fuller direction where it is fullest"),
    ),
    "assigned_streets",
    like="INPUT",
    renewed=("length_m",),
)
TRAFFIC_PLACES = LayerKind(
    "places",
    "Places and gates",
    "Point",
    (
        Field("place_id", "integer", "number of the place, from 1"),
        Field("kind", "text", "interior, or gate, where traffic enters and leaves"),
        Field("name", "text", "name or number of the gate"),
        Field("from_veh_h", "number", "vehicles per hour that begin here"),
        Field("to_veh_h", "number", "vehicles per hour that end here"),
    ),
    "traffic_places",
    on_request=True,
)
