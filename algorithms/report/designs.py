"""Which layers are of one design: by a field, by what the planner says, or by how they were made.

Layers of one run carry the same record. What was made of them later, as parcels of blocks or
figures of streets, has a record of its own, which does not name its inputs: it goes with the run
whose file or folder it shares, else with the one whose layers are called like its own.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import PurePath

from ..errors import InputError

#: Tools that make the same kind of thing: two of a set are two designs, as are two runs of one.
_RIVALS = (
    frozenset(("designstreets", "growstreets", "splitsite", "designcity")),
    frozenset(("parcelblocks", "splitsite", "optimiselayout", "resplitlayout")),
    frozenset(("designfloor", "designgamelevel")),
)
#: Tools whose runs begin a design, if there are any; what other tools made follows them.
_LEADERS = frozenset(
    (
        "designstreets",
        "growstreets",
        "splitsite",
        "designcity",
        "designfloor",
        "designgamelevel",
    )
)
#: Tools that bring data in rather than design.
DATA_TOOLS = frozenset(("osmboundary", "osmlayers", "preparesite", ""))


@dataclass(frozen=True)
class LayerFacts:
    """What is known of a layer that may be of a design.

    Attributes
    ----------
    key
        Tells it from the others.
    name
        What it is called.
    tool
        Name of the tool that made it, without its provider; empty where there is no record.
    specification, result
        What was asked and what came out, as JSON; empty where there is no record.
    place
        Its file, or empty for a layer that is none.
    designs
        Values of its field `design`; empty where it has none.
    """

    key: str
    name: str
    tool: str = ""
    specification: str = ""
    result: str = ""
    place: str = ""
    designs: tuple[str, ...] = ()

    @property
    def run(self) -> tuple[str, str, str]:
        """What all layers of one run share."""
        return self.tool, self.specification, self.result


@dataclass(frozen=True)
class DesignGroup:
    """One design.

    Attributes
    ----------
    name
        What it is called.
    layers
        Keys of its layers, in the order given.
    by_field
        Keys of those of them of which only the features count whose field `design` has its name.
    """

    name: str
    layers: tuple[str, ...]
    by_field: frozenset[str] = frozenset()


@dataclass
class _Group:
    """Runs that are one design so far."""

    layers: list[LayerFacts] = field(default_factory=list)

    @property
    def runs(self) -> set[tuple[str, str, str]]:
        return {layer.run for layer in self.layers}

    def clashes(self, other: _Group) -> bool:
        """Tell whether both hold a thing of the same kind, so that they are two designs."""
        tools = [run[0] for run in self.runs | other.runs]
        if len(tools) != len(set(tools)):
            return True
        return any(sum(tool in rivals for tool in tools) > 1 for rivals in _RIVALS)


def group_layers(
    layers: Sequence[LayerFacts], asked: Mapping[str, Sequence[str]] | None = None
) -> tuple[DesignGroup, ...]:
    """Return the designs that some layers are of.

    Parameters
    ----------
    layers
        The layers. Those without a record, or of tools that bring data in, are of no design
        unless they have a field `design` or are asked for.
    asked
        Names of layers by the name of the design that they are said to be of.

    Returns
    -------
    tuple of DesignGroup
        In the order in which they first occur.

    Raises
    ------
    InputError
        A layer that is asked for is not there.
    """
    said = _said(layers, asked or {})
    taken = {key for keys in said.values() for key in keys}
    split = [own for own in layers if own.designs and own.key not in taken]
    names = list(said) + [name for own in split for name in own.designs]
    rest = [
        own
        for own in layers
        if own.key not in taken and not own.designs and own.tool not in DATA_TOOLS
    ]
    made: dict[str, list[str]] = {name: list(said.get(name, ())) for name in dict.fromkeys(names)}
    for own in split:
        for name in own.designs:
            made[name].append(own.key)
    groups = _merged(rest)
    for name, group in zip(_names(groups, made), groups):
        made[name] = [own.key for own in group.layers]
    order = {own.key: at for at, own in enumerate(layers)}
    by_field = frozenset(own.key for own in split)
    return tuple(
        DesignGroup(name, tuple(sorted(keys, key=order.__getitem__)), by_field & set(keys))
        for name, keys in made.items()
        if keys
    )


def _said(layers: Sequence[LayerFacts], asked: Mapping[str, Sequence[str]]) -> dict[str, list[str]]:
    """Return the keys of layers by the design that the planner says they are of."""
    found: dict[str, list[str]] = {}
    for design, names in asked.items():
        for name in names:
            keys = [own.key for own in layers if own.name == name]
            if not keys:
                known = ", ".join(dict.fromkeys(own.name for own in layers))
                raise InputError(
                    f"Design '{design}' is to have the layer '{name}', which is not among the "
                    "layers of the report.",
                    f"Choose from: {known}.",
                )
            found.setdefault(design, []).extend(keys)
    return found


def _merged(layers: Iterable[LayerFacts]) -> list[_Group]:
    """Return layers by run, with the runs of one file, one folder, or all, joined."""
    by_run: dict[tuple[str, str, str], _Group] = {}
    for own in layers:
        by_run.setdefault(own.run, _Group()).layers.append(own)
    groups = list(by_run.values())
    for place_of in (_file, _folder, _anywhere):
        groups = _joined(groups, place_of)
    return _followed(groups)


def _file(own: LayerFacts) -> str:
    return own.place


def _folder(own: LayerFacts) -> str:
    return str(PurePath(own.place).parent) if own.place else ""


def _anywhere(own: LayerFacts) -> str:  # noqa: ARG001 - one of three
    return "anywhere"


def _joined(groups: list[_Group], place_of: Callable[[LayerFacts], str]) -> list[_Group]:
    """Join the groups of each place, unless two of them are rivals there."""
    places: dict[str, list[_Group]] = {}
    for group in groups:
        for place in {place_of(own) for own in group.layers} - {""}:
            places.setdefault(place, []).append(group)
    for here in places.values():
        # one may have been joined to another at another place already
        live = [group for group in here if any(group is other for other in groups)]
        if any(a.clashes(b) for at, a in enumerate(live) for b in live[at + 1 :]):
            continue
        for other in live[1:]:
            live[0].layers.extend(other.layers)
            groups = [group for group in groups if group is not other]
    return groups


def _followed(groups: list[_Group]) -> list[_Group]:
    """Join what only follows a design with the one that is called like it, or the only one."""
    leaders = [group for group in groups if any(run[0] in _LEADERS for run in group.runs)]
    called = [_words(leader) for leader in leaders]
    kept = list(leaders)
    for group in groups:
        if any(group is leader for leader in leaders):
            continue
        scores = [len(_words(group) & words) for words in called]
        best = [leader for leader, score in zip(leaders, scores) if score == max(scores)]
        if len(best) == 1:
            best[0].layers.extend(group.layers)
        else:
            kept.append(group)
    return kept


def _words(group: _Group) -> set[str]:
    """Return the words of which the names and files of a group's layers are made."""
    names = [name for own in group.layers for name in (own.name, PurePath(own.place).stem)]
    folders = [PurePath(own.place).parent.name for own in group.layers]
    return {
        word for name in (*names, *folders) for word in re.split(r"[\W_]+", name.lower()) if word
    }


def _names(groups: Sequence[_Group], taken: Mapping[str, object]) -> list[str]:
    """Return a name for each design: of its folder or file where they tell designs apart."""
    if len(groups) == 1 and not taken:
        return ["Design"]
    for place_of in (_folder, _file):
        stems = [{PurePath(place_of(own)).stem for own in group.layers} for group in groups]
        names = [next(iter(own)) if len(own) == 1 else "" for own in stems]
        if all(names) and len(set(names)) == len(names) and not set(names) & set(taken):
            return names
    numbered = (f"Design {number}" for number in itertools.count(len(taken) + 1))
    free = (name for name in numbered if name not in taken)
    return [next(free) for _ in groups]
