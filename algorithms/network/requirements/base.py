"""What every requirement on a whole network can do."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from ..structure import sink_distance

if TYPE_CHECKING:
    from ..cp.model import CpNetwork
    from ..mip.model import NetworkModel
    from ..problem import BoolArray, FloatArray, NetworkProblem


@dataclass(frozen=True, eq=False)
class View:
    """A design as a requirement sees it.

    Attributes
    ----------
    problem
        The problem.
    active
        Shape (e,). Chosen edges; existing ones are not among them.
    """

    problem: NetworkProblem
    active: BoolArray

    @cached_property
    def distance(self) -> FloatArray:
        """Shape (n,). Distance to a sink by chosen and existing edges; infinite without way."""
        return sink_distance(self.problem, self.active)


class Requirement(ABC):
    """A rule that looks at the whole network and not at a few edges.

    A subclass is a frozen dataclass without arrays of its own size that change. It may be
    used in several threads at once. Existing edges are streets in every design.

    Attributes
    ----------
    kind
        What it is called in counts, reports and relaxations, for example "link".
    penalty
        Cost of each violation; infinite forbids.
    """

    kind: str
    penalty: float

    @property
    def hard(self) -> bool:
        """Whether a violation is forbidden."""
        return math.isinf(self.penalty)

    @abstractmethod
    def violations(self, view: View) -> int:
        """Return how often a design breaks the requirement."""

    @abstractmethod
    def add_to_cp(self, network: CpNetwork) -> None:
        """Write the requirement into a CP-SAT model, exactly.

        The model is of the whole problem or of a window: edges that are not free are decided
        (`CpNetwork.literal`). Where it is soft, each violation costs `penalty`
        (`CpNetwork.cost`).
        """

    @abstractmethod
    def add_to_mip(self, model: NetworkModel) -> None:
        """Write the requirement into a mixed-integer program, exactly."""

    def places(self, view: View) -> Sequence[int]:  # noqa: ARG002
        """Return vertices near which a change may mend violations; none: anywhere may."""
        return ()

    def without(self, problem: NetworkProblem) -> Requirement | None:  # noqa: ARG002
        """Return what is left of it when a problem is cut down to fewer candidate edges.

        Parameters
        ----------
        problem
            The part: its candidate edges are among those of the whole.
        """
        return self
