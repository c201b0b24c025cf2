"""Simulate deformable bodies: hyperelastic solids, membranes, cloth, strands and particles.

>>> import pliant
>>> simulation = pliant.Simulation(pliant.Scene.from_toml("scenes/cantilever_fem_2d.toml"))
>>> summary = simulation.run(record="cantilever.mcap")
>>> pliant.load("cantilever.mcap").positions[:].shape
(121, 80, 2)

Arrays are float64 of shape (n, dim), in SI units. Steps of large scenes use all processors, or the number of
threads in the environment variable ``RAYON_NUM_THREADS`` at import. Results do not depend on it.
"""

from __future__ import annotations

import os as _os

from . import _pliant
from ._errors import SceneError, StepError
from ._pliant import Frame, Scene, Simulation, State, Superposition, __version__
from ._rerun import to_rerun
from ._run import Summary
from .accuracy import AccurateRun, ErrorBudget, Refinement, errors, refine, solve
from .actions import ForceAction, FunctionAction, PinAction, ValueAction
from .batch import Outcome, combinations, rollout, sweep
from .catalogue import catalogue
from .environments import VectorEnvironment, vector
from .gradients import ContactEvents, FrequencyGradient, Gradient, HessianProduct, WallEvent
from .material import Material
from .reports import Stability, StabilityMap, Stress, Study, stability, stress, study
from .tables import Table
from .trajectory import Frames, Trajectory, load, recover
from .vibration import Modes, Sound, modes, sound
from .view import LiveView, View

__all__ = [
    "AccurateRun",
    "ContactEvents",
    "ErrorBudget",
    "ForceAction",
    "Frame",
    "Frames",
    "FrequencyGradient",
    "FunctionAction",
    "Gradient",
    "HessianProduct",
    "LiveView",
    "Material",
    "Modes",
    "Outcome",
    "PinAction",
    "Refinement",
    "Scene",
    "SceneError",
    "Simulation",
    "Sound",
    "Stability",
    "StabilityMap",
    "State",
    "StepError",
    "Stress",
    "Study",
    "Summary",
    "Superposition",
    "Table",
    "Trajectory",
    "ValueAction",
    "VectorEnvironment",
    "View",
    "WallEvent",
    "__version__",
    "catalogue",
    "combinations",
    "errors",
    "load",
    "modes",
    "recover",
    "refine",
    "rollout",
    "solve",
    "sound",
    "stability",
    "stress",
    "study",
    "sweep",
    "to_rerun",
    "vector",
]

if hasattr(_os, "register_at_fork"):
    _os.register_at_fork(after_in_child=_pliant._after_fork)
