"""What a drawn template consists of."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Literal

from shapely.geometry import LineString, Point, Polygon

#: rigid: moved and turned; similarity: scaled alike in both directions, too; rectangle: scaled by
#: itself along its width and its depth; affine: sheared, too.
Deformation = Literal["rigid", "similarity", "rectangle", "affine"]
#: What lies beyond a piece of the outline (street, no street, any); what shape a line inside keeps
#: (straight, circle, smooth); the centre line of a street.
Meaning = Literal["street", "no street", "any", "straight", "circle", "smooth", "centre"]
#: Which corners of a region a vertex of the outline can be laid on.
CornerKind = Literal["convex", "concave", "regular"]

DEFORMATIONS: tuple[Deformation, ...] = ("rigid", "similarity", "rectangle", "affine")
OUTLINE_MEANINGS: tuple[Meaning, ...] = ("street", "no street", "any")
SHAPE_MEANINGS: tuple[Meaning, ...] = ("straight", "circle", "smooth")
MEANINGS: tuple[Meaning, ...] = (*OUTLINE_MEANINGS, *SHAPE_MEANINGS, "centre")
CORNER_KINDS: tuple[CornerKind, ...] = ("convex", "concave", "regular")
#: Labels of land that faces can stand for; any other label is the region label of templates that
#: fill the face.
LAND = ("parcel", "green", "court", "lane", "street", "building", "parking")
#: Labels that only templates of parcels (level 3) use.
FURNITURE = ("house", "driveway", "garden", "pool", "building", "parking")


@dataclass(frozen=True)
class Face:
    """A face of a template: a parcel, a green, a piece of street, or room for another template.

    Attributes
    ----------
    polygon
        Its outline as drawn, without holes; metres.
    label
        What it is: one of `LAND` or `FURNITURE`, or the region label of other templates.
    deform
        See `Deformation`.
    width_min, width_max, depth_min, depth_max
        How much it may be scaled along its width and its depth, as factors of what is drawn; the
        first two alone where it is scaled alike in both, and for both principal distortions where
        it is affine.
    axis
        Direction of its width, degrees counter-clockwise from the drawing's x axis.
    repeat
        Empty, or "x" or "y", the direction in which it is repeated, perhaps with a name after it
        ("x north"): faces of one name are repeated together.
    repeat_ideal, repeat_min, repeat_max
        Length of one repeat wished for and its bounds, metres; 0: as drawn, 0.7 and 1.4 of it.
    tolerance
        How far its vertices may be off; faces with a small one win over others. Metres.
    """

    polygon: Polygon
    label: str = "parcel"
    deform: Deformation = "rectangle"
    width_min: float = 0.8
    width_max: float = 1.3
    depth_min: float = 0.8
    depth_max: float = 1.3
    axis: float = 0.0
    repeat: str = ""
    repeat_ideal: float = 0.0
    repeat_min: float = 0.0
    repeat_max: float = 0.0
    tolerance: float = 1.0


@dataclass(frozen=True)
class Edge:
    """A line of a template.

    Attributes
    ----------
    line
        As drawn, metres; on the outline where it tells what lies beyond.
    meaning
        See `Meaning`.
    """

    line: LineString
    meaning: Meaning = "street"


@dataclass(frozen=True)
class CornerMark:
    """A vertex of the outline that is told what it is, whatever its angle.

    Attributes
    ----------
    point
        The vertex, metres.
    kind
        See `CornerKind`.
    """

    point: Point
    kind: CornerKind = "convex"


@dataclass(frozen=True)
class Template:
    """A drawn pattern that is warped into regions (UP section 4).

    Attributes
    ----------
    name
        Its name, unique in the library.
    level
        1: fills an area with blocks; 2: fills a block with parcels; 3: fills a parcel.
    region_label
        Which regions it fills ("block", "row", "parcel"...).
    faces, edges, corners
        The drawing.
    probability
        Weight of the template where several fit, greater than 0.
    min_uses, max_uses
        How often a layout should use it at least and may use it at most; -1: as often as it likes.
    mirror
        Whether its mirror image will do as well.
    lot_width, lot_depth
        Size of the parcel that the drawing was made for: where the planner asks for another one,
        parcels are scaled and streets are not. 0: never scaled. Metres.
    description
        For people.
    """

    name: str
    level: int = 2
    region_label: str = "block"
    faces: tuple[Face, ...] = ()
    edges: tuple[Edge, ...] = ()
    corners: tuple[CornerMark, ...] = ()
    probability: float = 1.0
    min_uses: int = 0
    max_uses: int = -1
    mirror: bool = False
    lot_width: float = 0.0
    lot_depth: float = 0.0
    description: str = ""


@dataclass(frozen=True)
class TemplateLibrary:
    """Templates in the order in which they were drawn.

    Attributes
    ----------
    templates
        The templates, their names differ.
    """

    templates: tuple[Template, ...] = field(default_factory=tuple)

    def __iter__(self) -> Iterator[Template]:
        return iter(self.templates)

    def __len__(self) -> int:
        return len(self.templates)

    def __getitem__(self, name: str) -> Template:
        for template in self.templates:
            if template.name == name:
                return template
        raise KeyError(name)

    def labelled(self, region_label: str) -> tuple[Template, ...]:
        """Return the templates for regions of a label.

        Parameters
        ----------
        region_label
            The label.
        """
        return tuple(t for t in self.templates if t.region_label == region_label)
