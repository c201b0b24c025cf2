"""Errors of scenes and steps."""

from __future__ import annotations

from typing import Any


class SceneError(ValueError):
    """Error of a scene that cannot be read or simulated.

    Attributes
    ----------
    message : str
        All problems as a compiler shows them: position, line of the text, remedy. For scenes made from tables
        in Python the position is the path of the key.
    line : int or None
        Line of the first problem, from 1; None for scenes without text.
    column : int or None
        Column of the first problem in characters, from 1.
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
    """Error of a failed step; the state is the last valid one.

    Attributes
    ----------
    message : str
        What happened, where, and what to change.
    step : int
        Number of the failed step, from 1.
    time : float
        Time at the start of the step [s].
    element : int or None
        Element (or spring, hinge, joint) of `body` that failed, if known.
    J : float or None
        ``det F`` of that element.
    body : str or None
        Body of that element.
    vertex : int or None
        First vertex whose position or velocity is not finite.
    step_size : float
        Attempted step size [s].
    stable_step : float or None
        Largest stable step at the initial state [s], if known.
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
