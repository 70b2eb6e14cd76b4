"""Everything that a planner asks of a street network, serialisable to JSON."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, get_args

from ..errors import InputError
from .level_settings import LevelSettings, checked, from_plain, to_plain

#: Weight of a rule that must never be broken.
FORBID = math.inf
#: Weight of a rule that does not matter.
ALLOW = 0.0

SinkMode = Literal["streets", "boundary", "access", "points"]
RuleSet = Literal["planner", "paper"]
CoverageUnit = Literal["edges", "metres", "straight"]
Traffic = Literal["out", "within", "through"]
OneWay = Literal["none", "local", "all"]
_WORDS = {
    "rules": get_args(RuleSet),
    "coverage_unit": get_args(CoverageUnit),
    "sink_mode": get_args(SinkMode),
    "traffic": get_args(Traffic),
    "one_way": get_args(OneWay),
}


@dataclass(frozen=True)
class Specification:
    """What a street network should do (CND section 4, and the rules that real sites need).

    Rule weights are costs per violation: `ALLOW` (0) ignores a rule, `FORBID` (infinity)
    makes it hard. None means: take the value that the rule set and the block size imply.

    Attributes
    ----------
    rules
        "planner" adds straight streets, blocks of the wished size and the continuation of
        existing streets; "paper" is CND as published.
    block_width, block_length
        Wished block size in metres (72 = two rows of 30 m lots and a 12 m street).
    edge_length
        Edge length of the candidate mesh in metres.
    coverage, coverage_unit
        Every mesh vertex lies within this range of a street (CND section 4.2), in mesh edges,
        in metres along the mesh, or in metres as the crow flies ("straight").
    weight_length
        Cost of street length (CND lambda_L), per mesh edge length.
    weight_distance
        Cost of the distance to the nearest sink (CND lambda_D), per mesh edge length.
    weight_straight
        Cost of each street end that does not go straight on at a junction or bend.
    weight_continue
        Cost of each existing street that is not continued into the site.
    dead_ends, zigzags, too_close, t_junctions, branches
        Weights of the local rules (CND section 4.3).
    sink_mode
        Where traffic leaves: "streets" (the boundary along existing streets), "boundary" (all
        of it), "access" (where existing streets arrive), "points" (given points).
    traffic
        What the streets are for (CND section 3 iii): ways "out" of the site, ways "within" it
        (point-to-point links between patches), or ways "through" it (routes without branches
        between places on its edge).
    patch_size
        Side of the patches between which ways within the site are short, metres; None for three
        block lengths.
    detour
        By how much a link between patches, or a through route, may be longer than the shortest
        possible way, in mesh edges (CND section 4.2: 2).
    links
        Cost of each link or route that is missing.
    exits
        Greatest number of places where streets may leave, wherever they are; None for any.
    length_budget
        Greatest length of all new streets, metres; None for any.
    max_distance
        Longest way out from any junction, metres along streets; None for any.
    junction_spacing
        Least way between two junctions, metres along a street; None for any.
    one_way
        Which new streets are one-way: "none", "local" ones, or "all". Every junction still has a
        way out and a way in, for which no street may be the only one to a place.
    slope_weight
        How much dearer streets get on slopes, where heights are given: the length is multiplied
        by 1 + slope_weight * (grade / 6 %)².
    levels
        1 for one network, 2 for collectors and then local streets.
    level_settings
        What is asked otherwise of some levels (2 collector, 3 local, 4 cul-de-sac, and the
        speed of 1 major), see `LevelSettings`.
    cul_de_sacs
        Whether culs-de-sac follow after the local streets, where ground is left too deep.
    cul_de_sac_length
        Greatest length of a cul-de-sac in metres.
    turning_radius
        Radius of the turning circle at its end in metres; 0 for none.
    time_limit
        Seconds for all solving.
    gap
        Relative gap at which a solve may stop.
    seed
        Seed of every random choice.
    solver
        "auto", "cpsat", "highs", or the name of another solver that PuLP finds.
    effort
        Windows that the search solves for every 100 candidate edges of a program, on one thread;
        then the same seed gives the same design, as long as the time limit is not reached first.
        Of CP-SAT only; None for a search that ends by its time or its gap.
    """

    rules: RuleSet = "planner"
    block_width: float = 72.0
    block_length: float = 150.0
    edge_length: float | None = None
    coverage: float | None = None
    coverage_unit: CoverageUnit = "edges"
    weight_length: float = 1.0
    weight_distance: float = 0.0
    weight_straight: float | None = None
    weight_continue: float | None = None
    dead_ends: float = FORBID
    zigzags: float | None = None
    too_close: float | None = None
    t_junctions: float = ALLOW
    branches: float = ALLOW
    sink_mode: SinkMode = "streets"
    traffic: Traffic = "out"
    patch_size: float | None = None
    detour: float = 2.0
    links: float | None = None
    exits: int | None = None
    length_budget: float | None = None
    max_distance: float | None = None
    junction_spacing: float | None = None
    one_way: OneWay = "none"
    slope_weight: float = 1.0
    levels: int = 2
    level_settings: Mapping[int, LevelSettings] = field(default_factory=dict, hash=False)
    cul_de_sacs: bool = False
    cul_de_sac_length: float = 150.0
    turning_radius: float = 9.0
    time_limit: float = 30.0
    gap: float = 0.01
    seed: int = 1
    solver: str = "auto"
    effort: float | None = None

    def __post_init__(self) -> None:
        """Check the ranges; raise `InputError` that names the field."""
        object.__setattr__(self, "level_settings", checked(self.level_settings))
        for name, words in _WORDS.items():
            if getattr(self, name) not in words:
                raise InputError(
                    f"{name} is {getattr(self, name)!r}.", f"Give one of {', '.join(words)}."
                )
        for name in ("block_width", "block_length", "cul_de_sac_length", "time_limit"):
            if not 0 < getattr(self, name) < math.inf:
                raise InputError(f"{name} must be greater than 0.", "Give a positive number.")
        if self.edge_length is not None and not 0 < self.edge_length < math.inf:
            raise InputError("edge_length must be greater than 0.", "Give a length in metres.")
        for name in ("patch_size", "length_budget", "max_distance", "junction_spacing", "effort"):
            value = getattr(self, name)
            if value is not None and not 0 < value < math.inf:
                raise InputError(f"{name} must be greater than 0.", "Give a number, or nothing.")
        if self.exits is not None and not _whole(self.exits):
            raise InputError("exits must be 1 or more.", "Give a whole number, or nothing.")
        if self.block_length < self.block_width:
            raise InputError(
                f"Block length ({self.block_length:g} m) is less than block width "
                f"({self.block_width:g} m).",
                "Make the block length the larger of the two.",
            )
        for name in (
            "coverage",
            "weight_length",
            "weight_distance",
            "weight_straight",
            "weight_continue",
            "dead_ends",
            "zigzags",
            "too_close",
            "t_junctions",
            "branches",
            "turning_radius",
            "detour",
            "links",
            "slope_weight",
            "gap",
        ):
            value = getattr(self, name)
            if value is not None and not value >= 0:
                raise InputError(f"{name} must not be negative.", "Give 0 or more.")
        for name in ("detour", "slope_weight"):
            if math.isinf(getattr(self, name)):
                raise InputError(f"{name} must be finite.", "Give a number.")
        in_edges = self.coverage is not None and self.coverage_unit == "edges"
        if in_edges and self.coverage is not None and not _whole(self.coverage):
            raise InputError(
                f"A coverage of {self.coverage:g} edges is not possible.",
                "Give a whole number of edges, 1 or more, or a range in metres.",
            )
        if self.levels not in (1, 2):
            raise InputError("levels must be 1 or 2.", "Choose 1 or 2 street levels.")

    def at_level(self, level: int) -> Specification:
        """Return the specification as it is for one level.

        Examples
        --------
        >>> spec = Specification(level_settings={2: LevelSettings(weight_length=3.0)})
        >>> spec.at_level(2).weight_length, spec.at_level(3).weight_length
        (3.0, 1.0)
        """
        own = self.level_settings.get(level)
        changes = own.changes() if own is not None else {}
        return dataclasses.replace(self, **changes) if changes else self

    def to_json(self) -> str:
        """Return the specification as JSON; infinite weights become the text "forbid"."""
        values = {
            key: "forbid" if isinstance(value, float) and math.isinf(value) else value
            for key, value in dataclasses.asdict(self).items()
        }
        values["level_settings"] = to_plain(self.level_settings)
        return json.dumps(values, sort_keys=True)

    @classmethod
    def from_json(cls, text: str, site_id: int | None = None) -> Specification:
        """Read what `to_json` or `sites_json` wrote, as it is stored with every layer.

        Parameters
        ----------
        text
            The JSON.
        site_id
            The site whose specification is wanted; needed where each site has its own.

        Raises
        ------
        InputError
            The text is no specification, has unknown keys, or none for the site.

        Examples
        --------
        >>> spec = Specification(block_width=60.0)
        >>> Specification.from_json(spec.to_json()) == spec
        True
        >>> Specification.from_json(sites_json({1: Specification(), 2: spec}), site_id=2) == spec
        True
        """
        values = _object(text)
        if "sites" in values:
            values = _own(values["sites"], site_id)
        known = {f.name for f in dataclasses.fields(cls)}
        unknown = sorted(set(values) - known)
        if unknown:
            raise InputError(
                f"Unknown keys in the specification: {', '.join(unknown)}.",
                f"Known keys are: {', '.join(sorted(known))}.",
            )
        fields: dict[str, Any] = {k: FORBID if v == "forbid" else v for k, v in values.items()}
        if "level_settings" in fields:
            fields["level_settings"] = from_plain(fields["level_settings"])
        try:
            return cls(**fields)
        except TypeError as error:
            raise InputError(f"{_NOT_ONE} ({error}).", _REMEDY) from error


_NOT_ONE = "The text is no specification"
_REMEDY = "Give what `Specification.to_json` or `sites_json` wrote."


def sites_json(specifications: Mapping[int, Specification]) -> str:
    """Return the specifications of several sites as one JSON; `from_json` reads it back.

    Parameters
    ----------
    specifications
        The specification of each site by its `site_id`.
    """
    rows = {str(key): json.loads(own.to_json()) for key, own in specifications.items()}
    return json.dumps({"sites": rows}, sort_keys=True)


def _object(text: str) -> dict[str, Any]:
    """Return a JSON object, or raise `InputError`."""
    try:
        values = json.loads(text)
    except ValueError as error:
        raise InputError(f"{_NOT_ONE} ({error}).", _REMEDY) from error
    if not isinstance(values, dict):
        raise InputError(f"{_NOT_ONE}.", _REMEDY)
    return values


def _own(sites: Any, site_id: int | None) -> dict[str, Any]:
    """Return the values of one site, or raise `InputError`."""
    if not isinstance(sites, dict) or not all(isinstance(own, dict) for own in sites.values()):
        raise InputError(f"{_NOT_ONE}.", _REMEDY)
    if str(site_id) not in sites:
        raise InputError(
            f"There is a specification for each of the sites {', '.join(sorted(sites))}, none "
            f"{'for all' if site_id is None else f'for site {site_id}'}.",
            "Name one of them by site_id, as the layers do.",
        )
    return dict(sites[str(site_id)])


def _whole(number: float) -> bool:
    """Tell whether a number is whole and at least 1."""
    return number >= 1 and math.isfinite(number) and number == int(number)
