"""What scenes can be made of."""

from __future__ import annotations

from typing import Any, Literal

from ._pliant import _catalogue


def catalogue(
    family: Literal["integrators", "materials", "presets", "elements", "meshes", "channels"],
) -> dict[str, dict[str, Any]]:
    """Members of a family of things that scenes can name, as ``pliant list``.

    The texts are those of the documentation of the library itself.

    Parameters
    ----------
    family : {"integrators", "materials", "presets", "elements", "meshes", "channels"}
        Which. Channels are what recordings can hold, and what `Simulation.measure` measures.

    Returns
    -------
    dict of str to dict
        By name: ``summary``, ``formula``, ``source``, ``order``, ..., as ``pliant list --json`` prints them.

    Raises
    ------
    ValueError
        There is no such family.

    Examples
    --------
    >>> catalogue("integrators")["rk4"]["order"]
    4
    """
    families: dict[str, list[dict[str, Any]]] = _catalogue()
    if family not in families:
        raise ValueError(f"there is no family {family!r}; there are {', '.join(families)}")
    return {item["name"]: item for item in families[family]}
