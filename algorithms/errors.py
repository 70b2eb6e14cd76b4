"""The few errors that the library raises, all readable by a planner.

Every text names the layer, where one is known the feature, and the way out, so that an
adapter can show it as it is.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .network.why.whynot import Diagnosis


class PlatwrightError(Exception):
    """Base of every error that the library raises on purpose."""


class InputError(PlatwrightError):
    """A layer or a parameter cannot be used.

    Parameters
    ----------
    problem
        What is wrong, as a sentence.
    remedy
        What to do about it, as a sentence.
    layer
        Name of the layer, or None.
    feature
        Id of the feature in that layer, or None.
    """

    def __init__(
        self,
        problem: str,
        remedy: str = "",
        *,
        layer: str | None = None,
        feature: int | str | None = None,
    ) -> None:
        where = "" if layer is None else f"Layer '{layer}'"
        if feature is not None:
            where += f", feature {feature}" if where else f"Feature {feature}"
        msg = f"{where}: {problem}" if where else problem
        if remedy:
            msg = f"{msg} {remedy}"
        super().__init__(msg)
        self.problem = problem
        self.remedy = remedy
        self.layer = layer
        self.feature = feature


class MeshError(PlatwrightError):
    """No candidate mesh could be made of a site."""


class InfeasibleError(PlatwrightError):
    """No design satisfies what was asked; the text names the rules in conflict.

    Parameters
    ----------
    text
        Why, in sentences.
    diagnosis
        The same as data, with places for a map (`network.why.whynot.Diagnosis`), or None where no
        design was found in time and none is proven impossible.
    """

    def __init__(self, text: str, diagnosis: Diagnosis | None = None) -> None:
        super().__init__(text)
        self.diagnosis = diagnosis


class MissingDependencyError(PlatwrightError):
    """A Python package that this computation needs is not installed."""


class CancelledError(PlatwrightError):
    """The run was cancelled before anything worth keeping existed."""


class ServiceError(PlatwrightError):
    """An online service could not be reached, refused, or answered with something unusable.

    Parameters
    ----------
    url
        Address of the service; credentials in it are not shown.
    problem
        What happened, as the rest of a sentence that begins with the service.
    remedy
        What to do about it, as a sentence.
    """

    def __init__(self, url: str, problem: str, remedy: str) -> None:
        self.url = without_credentials(url)
        self.problem = problem
        self.remedy = remedy
        super().__init__(f"The OpenStreetMap service {self.url} {problem}. {remedy}")


def without_credentials(url: str) -> str:
    """Give an address without the user and password that it may carry.

    Parameters
    ----------
    url
        Any address.
    """
    start, slashes, rest = url.partition("://")
    host, slash, path = rest.partition("/")
    return f"{start}{slashes}{host.rpartition('@')[2]}{slash}{path}" if slashes else url
