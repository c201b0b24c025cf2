"""Reports as tables: columns by name, with plots by matplotlib."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    import pandas as _pandas
    from matplotlib.axes import Axes as _Axes

Array = npt.NDArray[Any]


class Table(Mapping[str, Array]):
    """Table: a mapping from column names to arrays of equal length.

    Parameters
    ----------
    columns : mapping of str to array_like
        Columns. None becomes NaN among numbers, and an empty text among texts.
    units : mapping of str to str, optional
        Unit of each column that has one.
    descriptions : mapping of str to str, optional
        Descriptions of columns, with their units in brackets.
    shown : sequence of str, optional
        Columns to print; default: all.

    Attributes
    ----------
    units : dict of str to str
        Unit of each column that has one.
    descriptions : dict of str to str
        Descriptions of columns.
    """

    def __init__(
        self,
        columns: Mapping[str, npt.ArrayLike],
        units: Mapping[str, str] | None = None,
        *,
        descriptions: Mapping[str, str] | None = None,
        shown: Sequence[str] | None = None,
    ) -> None:
        self._columns = {name: _column(column) for name, column in columns.items()}
        self.descriptions = {
            name: text for name, text in (descriptions or {}).items() if name in self._columns
        }
        found = ((name, re.search(r"\[([^\]]+)\]", text)) for name, text in self.descriptions.items())
        self.units = {name: unit[1] for name, unit in found if unit} | dict(units or {})
        self._shown = list(self._columns if shown is None else shown)
        lengths = {len(column) for column in self._columns.values()}
        if len(lengths) > 1:
            raise ValueError(f"columns of different lengths: {sorted(lengths)}")

    def __getitem__(self, name: str) -> Array:
        return self._columns[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)

    @property
    def rows(self) -> int:
        """int: Number of rows."""
        return len(next(iter(self._columns.values()), ()))

    def to_pandas(self) -> _pandas.DataFrame:
        """Convert to a pandas table, without columns of more than one axis.

        Returns
        -------
        pandas.DataFrame
            Table with the same rows.

        Examples
        --------
        >>> table = modes(scene, 2)
        >>> len(table.to_pandas())
        2
        """
        import pandas

        return pandas.DataFrame({name: column for name, column in self.items() if column.ndim == 1})

    def __repr__(self) -> str:
        flat = {name: self[name] for name in self._shown if self[name].ndim == 1}
        heads = [f"{name} [{self.units[name]}]" if name in self.units else name for name in flat]
        cells = [
            [f"{value:.6g}" if isinstance(value, float) else str(value) for value in column.tolist()]
            for column in flat.values()
        ]
        widths = [max(map(len, [head, *column])) for head, column in zip(heads, cells)]
        lines = [[head, *column] for head, column in zip(heads, cells)]
        text = [
            "  ".join(line[i].rjust(width) for line, width in zip(lines, widths))
            for i in range(self.rows + 1)
        ]
        return "\n".join(text)


def _column(values: npt.ArrayLike) -> Array:
    """Replace None by NaN among numbers, by an empty text among texts, by NaN if all are None."""
    if not isinstance(values, list) or None not in values:
        return np.asarray(values)
    nothing: Any = "" if any(isinstance(value, str) for value in values) else float("nan")
    return np.asarray([nothing if value is None else value for value in values])


def axes_or_new(axes: _Axes | None) -> _Axes:
    """Return the axes to draw into."""
    if axes is not None:
        return axes
    import matplotlib.pyplot as plt

    return plt.subplots()[1]
