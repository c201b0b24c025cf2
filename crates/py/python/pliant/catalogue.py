"""Catalogue of integrators, materials, meshes and other choices of scenes."""

from __future__ import annotations

from typing import Any, Literal

from ._pliant import _catalogue


def catalogue(
    family: Literal["integrators", "materials", "presets", "elements", "meshes", "channels"],
) -> dict[str, dict[str, Any]]:
    """Return the members of a family of choices of scenes, as ``pliant list``.

    The texts come from the documentation of the library.

    Parameters
    ----------
    family : {"integrators", "materials", "presets", "elements", "meshes", "channels"}
        Family. Channels are the contents of recordings, and the measures of `Simulation.measure`.

    Returns
    -------
    dict of str to dict
        Members by name: ``summary``, ``formula``, ``source``, ``order``, ..., as printed by
        ``pliant list --json``.

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
