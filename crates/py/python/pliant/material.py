"""Materials written in Python."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Function = Callable[[Array], npt.ArrayLike]


@dataclass(frozen=True)
class Material:
    """A hyperelastic material given by functions of many deformation gradients at once.

    ``Simulation(scene, materials={"beam": Material(density, stress)})`` uses it instead of the material that
    the scene gives to that body, which must be a solid: triangles in 2D (plane strain, per metre of
    thickness), tetrahedra in 3D. A material can be pickled if its functions can.

    Attributes
    ----------
    density : callable
        ``density(F)`` with ``F`` of shape (m, dim, dim) returns the energy density ``psi``, of shape (m,)
        [J/m^3]: ``inf`` outside the domain of the material.
    stress : callable
        ``stress(F)`` returns the first Piola-Kirchhoff stress ``P = dpsi/dF``, of shape (m, dim, dim) [Pa].
    tangent : callable, optional
        ``tangent(F)`` returns ``dP_ij/dF_kl``, of shape (m, dim, dim, dim, dim) [Pa]. Implicit integrators
        and stability limits need it. By default it comes from central differences of `stress`, to about 1e-10
        instead of round-off, in ``2 dim**2`` evaluations. Solvers project it to positive definite matrices
        where they need to.

    Notes
    -----
    A Python material is much slower than the compiled, vectorised ones of this library: each evaluation of
    the force goes through NumPy and holds the GIL. A `RuntimeWarning` states how slow after a few steps.
    Functions get a fresh array, which they may overwrite.

    The stress cannot be derived from the density here, as it is for materials in Rust: those run on dual
    numbers, exact to round-off, while differences of a density have six digits.

    In 2D the out-of-plane stress is unknown, so that it and measures that depend on it, such as the von Mises
    stress, are NaN.

    Examples
    --------
    St. Venant-Kirchhoff:

    >>> mu, lam, eye = 4e4, 6e4, np.eye(2)
    >>> strain = lambda F: 0.5 * (np.swapaxes(F, 1, 2) @ F - eye)
    >>> trace = lambda E: np.trace(E, axis1=1, axis2=2)
    >>> density = lambda F: mu * (strain(F) ** 2).sum((1, 2)) + 0.5 * lam * trace(strain(F)) ** 2
    >>> stress = lambda F: F @ (2 * mu * strain(F) + lam * trace(strain(F))[:, None, None] * eye)
    >>> simulation = Simulation(scene, materials={"beam": Material(density, stress)})
    """

    density: Function
    stress: Function
    tangent: Function | None = None

    def check(self, dimension: int, *, count: int = 8, size: float = 0.1, seed: int = 0) -> None:
        """Compare the stress with differences of the density, and the tangent with those of the stress.

        Parameters
        ----------
        dimension : int
            2 or 3.
        count : int, default 8
            Number of random deformation gradients near the identity.
        size : float, default 0.1
            Largest difference of their components from the identity.
        seed : int, default 0
            Seed of the random numbers.

        Raises
        ------
        ValueError
            One is not the derivative of the other; the message has the largest difference and its position.

        Examples
        --------
        >>> Material(lambda F: 0.5 * ((F - np.eye(2)) ** 2).sum((1, 2)), lambda F: F - np.eye(2)).check(2)
        """
        random = np.random.default_rng(seed)
        eye = np.eye(dimension)
        f = eye + size * random.uniform(-1.0, 1.0, (count, dimension, dimension))
        pairs: list[tuple[str, Function, str, Function]] = [("stress", self.stress, "density", self.density)]
        if self.tangent is not None:
            pairs.append(("tangent", self.tangent, "stress", self.stress))
        step = 6e-6
        for name, derivative, of, function in pairs:
            found = np.asarray(derivative(f.copy()), dtype=float)
            expected = np.empty_like(found)
            for k in range(dimension):
                for m in range(dimension):
                    change = np.zeros((dimension, dimension))
                    change[k, m] = step
                    after, before = (
                        np.asarray(function(f + sign * change), dtype=float) for sign in (1.0, -1.0)
                    )
                    expected[..., k, m] = (after - before) / (2.0 * step)
            scale = max(float(np.abs(expected).max()), float(np.abs(found).max()))
            difference = np.abs(found - expected)
            if not difference.max() <= 1e-6 * scale:
                worst = np.unravel_index(int(np.nanargmax(difference)), difference.shape)
                where = tuple(int(i) for i in worst[1:])
                raise ValueError(
                    f"{name} is not the derivative of {of}: component {where} is {found[worst]:.6g}, "
                    f"by differences {expected[worst]:.6g}, at F = {f[worst[0]].tolist()}"
                )
