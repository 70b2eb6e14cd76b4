"""Faults of a grammar's file, gathered so that a planner hears of all of them at once."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

from ...errors import InputError

#: Most faults that one error tells of.
MOST = 10


@dataclass(frozen=True)
class Place:
    """A place in a grammar's file, and the faults found in the whole file so far.

    Attributes
    ----------
    source
        Name of the file, or what else the grammar came from.
    path
        Where in the file: the state, the number of the rule, the field.
    faults
        Shared by all places of a file: (where, what is wrong, what to do) of each fault.
    """

    source: str
    path: tuple[str, ...] = ()
    faults: list[tuple[str, str, str]] = field(default_factory=list)

    def at(self, part: str) -> Place:
        """Return a place inside this one.

        Parameters
        ----------
        part
            What it is called, such as "rule 2".
        """
        return replace(self, path=(*self.path, part))

    def say(self, problem: str, remedy: str) -> None:
        """Note a fault here.

        Parameters
        ----------
        problem
            What is wrong, as a sentence.
        remedy
            What to do about it, as a sentence.
        """
        self.faults.append((", ".join(self.path), problem, remedy))

    def nearest(
        self, word: str, names: Iterable[str], meanings: Mapping[str, str] | None = None
    ) -> str:
        """Return a question that names what was meant, or nothing where that is not clear.

        Parameters
        ----------
        word
            What was written.
        names
            What could have been.
        meanings
            Other ways to say a name -> the name.

        Returns
        -------
        str
            Such as "Did you mean thetas? ", with the space behind it; or empty. Always empty for
            faults that are not told of, so that a file full of them is refused at once.
        """
        if len(self.faults) >= MOST:
            return ""
        known = {name.casefold(): name for name in names}
        known |= {way.casefold(): name for way, name in (meanings or {}).items()}
        found = difflib.get_close_matches(word[:40].casefold(), known, n=1, cutoff=0.6)
        return f"Did you mean {known[found[0]]}? " if found else ""

    def settle(self) -> None:
        """Go on if no fault was found.

        Raises
        ------
        InputError
            If there are faults: with all of them, or the first ten.
        """
        if not self.faults:
            return
        if len(self.faults) == 1:
            where, problem, remedy = self.faults[0]
            raise InputError(f"Grammar '{self.source}'{where and f', {where}'}: {problem}", remedy)
        lines = [f"Grammar '{self.source}' has {len(self.faults)} faults."]
        for where, problem, remedy in self.faults[:MOST]:
            lines.append(f"- {where}: {problem} {remedy}" if where else f"- {problem} {remedy}")
        if len(self.faults) > MOST:
            lines.append(f"- And {len(self.faults) - MOST} more.")
        raise InputError("\n".join(lines))


def shown(value: object) -> str:
    """Return a value of a file as an error shows it.

    Parameters
    ----------
    value
        Anything that JSON can hold.
    """
    if value is None:
        return "null"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return f"{value:.15g}"
    if isinstance(value, str):
        return f"the text {value[:40]!r}"
    return f"a list of {len(value)}" if isinstance(value, list) else "an object"
