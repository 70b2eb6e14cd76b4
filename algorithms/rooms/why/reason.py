"""What stands in the way of every plan, and the error that says so."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from ...errors import InfeasibleError


@dataclass(frozen=True)
class Reason:
    """Something that makes every plan impossible.

    Attributes
    ----------
    problem, action
        What is wrong, and what to do, as sentences.
    faces
        Faces that it is about; none if it is about all.
    """

    problem: str
    action: str
    faces: tuple[int, ...] = ()

    @property
    def sentence(self) -> str:
        """Both sentences."""
        return f"{self.problem} {self.action}"


class NoPlanError(InfeasibleError):
    """There is no plan; `reasons` says why, with places.

    Parameters
    ----------
    reasons
        The reasons, at least one.
    """

    def __init__(self, reasons: Iterable[Reason]) -> None:
        self.reasons = tuple(reasons)
        super().__init__(" ".join(reason.sentence for reason in self.reasons))
