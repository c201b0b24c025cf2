"""What goes wrong."""

from __future__ import annotations

from typing import Any


class SceneError(ValueError):
    """A scene cannot be read, or says something that cannot be simulated.

    Attributes
    ----------
    message : str
        All problems as a compiler shows them: place, line of the text, what would be right. Of scenes made
        from tables in Python the path of the key is the place.
    line : int or None
        Line of the first problem, from 1; None without a text that a user wrote.
    column : int or None
        Its column in characters, from 1.
    problems : list of dict
        Each with ``kind``, ``path``, ``message``, ``help``, ``line``, ``column``.
    """

    def __init__(self, message: str, problems: list[dict[str, Any]] | None = None) -> None:
        super().__init__(message)
        self.message = message
        self.problems: list[dict[str, Any]] = problems or []
        first = self.problems[0] if self.problems else {}
        self.line: int | None = first.get("line")
        self.column: int | None = first.get("column")

    def __reduce__(self) -> tuple[type[SceneError], tuple[str, list[dict[str, Any]]]]:
        return (type(self), (self.message, self.problems))


class StepError(RuntimeError):
    """A step could not be taken; the state is the last good one.

    Attributes
    ----------
    message : str
        What happened, where, and what to change.
    step : int
        The step that was tried, from 1.
    time : float
        Time at its beginning [s].
    element : int or None
        Element (or spring, hinge, joint) of `body` at fault, where one is.
    J : float or None
        ``det F`` there.
    body : str or None
        Its body.
    vertex : int or None
        First vertex whose position or velocity is not finite.
    step_size : float
        Step size that was tried [s].
    stable_step : float or None
        Largest stable step at the start [s], where it is known.
    """

    def __init__(
        self,
        message: str,
        step: int = 0,
        time: float = float("nan"),
        element: int | None = None,
        J: float | None = None,
        body: str | None = None,
        vertex: int | None = None,
        step_size: float = float("nan"),
        stable_step: float | None = None,
    ) -> None:
        super().__init__(message)
        self.message = message
        self.step = step
        self.time = time
        self.element = element
        self.J = J
        self.body = body
        self.vertex = vertex
        self.step_size = step_size
        self.stable_step = stable_step

    def __reduce__(self) -> tuple[type[StepError], tuple[Any, ...]]:
        state = (self.step, self.time, self.element, self.J, self.body, self.vertex, self.step_size)
        return (type(self), (self.message, *state, self.stable_step))
