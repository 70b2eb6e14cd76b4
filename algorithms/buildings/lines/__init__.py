"""Control lines: where the buildings of a pattern may stand (RZ section 3.2)."""

from .control import anywhere, control_lines

__all__ = ["anywhere", "control_lines"]
