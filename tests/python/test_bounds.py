"""Bounds of keys: the schema that editors read and the reader of scenes refuse the same values."""

from __future__ import annotations

import copy
import json
import subprocess
import tomllib
from collections.abc import Iterator
from typing import Any

import jsonschema
import pliant
import pytest
from conftest import SCENES

BOUNDS = {"minimum", "maximum", "exclusiveMinimum", "exclusiveMaximum"}
NUMBERS = {"number", "integer"}
# Around every bound in the schema, beyond it and on it.
TRIED = [-1.0, 0.0, 0.25, 0.5, 1.0, 2.0, 2.5, 1e3]
# Words with which the reader refuses a value for itself, and not because of another.
OF_ITSELF = (
    *(
        "must be positive",
        "must be at least",
        "must be 0 or more",
        "must be 1 or more",
        "must be between",
        "must be above",
    ),
    *("makes the bulk modulus", "makes the shear modulus infinite"),
)

Schema = dict[str, Any]
Leaf = tuple[tuple[str | int, ...], str]

HEADER: dict[str, Any] = {
    "time": {"integrator": "implicit-euler", "step": 1e-3, "duration": 1.0},
    "output": {"rate": 60.0, "channels": ["state"]},
}
SOLID = {"mass": {"density": 1e3}, "elastic": {"corotated": {"young": 1e5, "poisson": 0.3}}}


def solid(dimension: int, mesh: dict[str, Any], **other: Any) -> dict[str, Any]:
    return {"dimension": dimension, **copy.deepcopy(HEADER), "body": [{"mesh": mesh, **SOLID}], **other}


def made_of(elastic: dict[str, Any]) -> dict[str, Any]:
    return {**solid(2, GRID), "body": [{"mesh": GRID, "mass": {"density": 1e3}, "elastic": elastic}]}


GRID = {"grid": {"cells": [2, 2], "spacing": 0.1}}
TIE = {"vertices": [0], "points": [[0.0, 0.1]], "total_stiffness": 10.0, "rest_length": 0.1}
# Keys with bounds that no shipped scene names.
MORE: list[dict[str, Any]] = [
    {**solid(2, GRID), "body": [{"mesh": GRID, **SOLID, "elastic_factor": [1.0] * 7 + [0.5]}]},
    {**solid(2, GRID), "body": [{"mesh": GRID, **SOLID, "elastic_factor": 0.5}]},
    solid(3, {"cylinder": {"cells": [2, 2], "height": 1.0, "radius": 0.5}}),
    solid(2, {"tapered_beam": {"cells": [2, 2], "length": 10.0, "heights": [5.0, 1.0]}}),
    solid(2, {"elliptic_membrane": {"cells": [2, 2], "inner": [2.0, 1.0], "outer": [3.25, 2.75]}}),
    solid(2, GRID, study={"steps": [1e-3, 2e-3], "tolerances": [1e-3, 1e-4]}),
    solid(2, GRID, study={"refine": 3}, accuracy={"of": "tip.y", "error": "1 %", "budget": 60.0}),
    {**solid(2, GRID), "body": [{"mesh": GRID, **SOLID, "refine": 1}]},
    solid(
        2, {"notched_beam": {"cells": [2, 2, 2], "length": 4.0, "height": 1.0, "depth": 0.5, "width": 0.5}}
    ),
    solid(2, GRID, probe=[{"name": "cut", "at": [0.0, 0.0], "line": {"to": [0.2, 0.2], "points": 3}}]),
    solid(2, {"file": {"path": "mesh.obj", "merge": 1e-6}}),
    solid(3, {"surface": {"path": "mesh.obj", "cells": 4, "merge": 1e-6}}),
    solid(3, {"surface": {"path": "mesh.obj", "spacing": 0.1}}),
    solid(2, GRID, attachment=[TIE], study={"error": 0.01, "smallest_step": 1e-6, "times": 30}),
    solid(2, GRID, time={**HEADER["time"], "solver": {"iterations": 5}}),
    solid(2, GRID, time={**HEADER["time"], "integrator": {"newmark": {"beta": 0.25, "gamma": 0.5}}}),
    solid(2, GRID, time={**HEADER["time"], "integrator": {"generalised-alpha": {"rho": 0.5}}}),
    solid(
        2,
        GRID,
        time={
            "integrator": "dormand-prince5",
            "duration": 1.0,
            "adaptive": {"position": 1.0, "velocity": 1.0},
        },
    ),
    made_of({"mooney-rivlin": {"young": 1e5, "poisson": 0.3, "c10": 0.4, "c01": 0.1}}),
    made_of({"ogden": {"young": 1e5, "poisson": 0.3, "mu": [1.0], "alpha": [2.0]}}),
    made_of(
        {
            "holzapfel-gasser-ogden": {
                "shear": 1e4,
                "bulk": 1e5,
                "k1": 1e4,
                "k2": 0.8,
                "dispersion": 0.1,
                "fibres": [[1, 0]],
            }
        }
    ),
    made_of({"arap": {"young": 1e5, "poisson": 0.0}}),
    made_of({"neo-hookean": {"bulk": 1e5, "shear": 5e4}}),
    made_of({"neo-hookean": {"lambda": 1e5, "mu": 5e4}}),
    made_of({"linear": {"bulk": 1e5, "shear": 5e4}}),
    made_of({"linear": {"lambda": 1e5, "mu": 5e4}}),
    made_of({"mooney-rivlin": {"c10": 1e4, "c01": 1e3, "d1": 1e-5}}),
    {
        **solid(2, GRID),
        "body": [{"mesh": GRID, **SOLID, "contact": {"radius": 1e-3}}],
        "contact": {
            **{"distance": 1e-3, "stiffness": 1e5, "friction": 0.3, "threshold_speed": 1e-3},
            **{"friction_iterations": 5, "pairs": [{"between": ["body0", "body0"], "friction": 0.1}]},
        },
        "obstacle": [
            {"shape": {"ball": {"centre": [9.0, 9.0], "radius": 1.0}}},
            {"shape": {"capsule": {"axis": [[9.0, 5.0], [9.0, 6.0]], "radius": 1.0}}},
        ],
    },
    made_of({"dirichlet": {"stiffness": 1e5}}),
    made_of(
        {
            "expression": {
                "psi": "k/2*(I1 - 3) - k*ln(J) + c/8*(I4 - 1)^2",
                "parameters": {"k": 1e5, "c": 1e4},
                "fibres": [[1.0, 1.0]],
            }
        }
    ),
    {
        **solid(2, GRID),
        "body": [
            {
                "mesh": GRID,
                "springs": {"stiffness": 9.0, "rest_length": 0.1},
                "mass": {"total": 1.0},
                "damping": {"dashpot": 0.1},
            }
        ],
    },
]


@pytest.fixture(scope="module")
def schema(programs: list[str]) -> Schema:
    printed = subprocess.run([programs[0], "schema"], check=True, capture_output=True).stdout
    read: Schema = json.loads(printed)
    return read


def variants(schema: Schema, node: Schema) -> Iterator[tuple[str, Schema]]:
    """The alternatives of a node, each with the name of its definition."""
    waiting = [("", node)]
    while waiting:
        name, node = waiting.pop()
        if "$ref" in node:
            name = node["$ref"].removeprefix("#/$defs/")
            waiting.append((name, schema["$defs"][name]))
        for kind in ("anyOf", "oneOf", "allOf"):
            waiting.extend((name, one) for one in node.get(kind, []))
        yield name, node


def kinds(node: Schema) -> set[str]:
    kind = node.get("type", [])
    return {kind} if isinstance(kind, str) else set(kind)


def numbers(
    schema: Schema, node: Schema, value: Any, path: tuple[str | int, ...] = (), of: str = ""
) -> Iterator[Leaf]:
    """Numbers in a value: path in the value, name in the schema."""
    for name, variant in variants(schema, node):
        name = name or of
        if isinstance(value, dict):
            for key in value.keys() & variant.get("properties", {}).keys():
                yield from numbers(
                    schema, variant["properties"][key], value[key], (*path, key), f"{name}.{key}"
                )
        elif isinstance(value, list) and value and isinstance(variant.get("items"), dict):
            for index in {0, len(value) - 1}:
                yield from numbers(schema, variant["items"], value[index], (*path, index), f"{name}[]")
        elif NUMBERS & kinds(variant) and not isinstance(value, (dict, list, bool)):
            yield path, name


def with_value(tables: dict[str, Any], path: tuple[str | int, ...], value: float) -> dict[str, Any]:
    changed = copy.deepcopy(tables)
    at: Any = changed
    for key in path[:-1]:
        at = at[key]
    whole = isinstance(at[path[-1]], int) and value.is_integer()
    at[path[-1]] = int(value) if whole else value
    return changed


def refusal(tables: dict[str, Any]) -> str:
    try:
        pliant.Scene(**tables)
    except pliant.SceneError as error:
        return str(error)
    return ""


def scenes() -> list[dict[str, Any]]:
    return [tomllib.loads(path.read_text()) for path in sorted(SCENES.glob("*.toml"))] + MORE


def names(schema: Schema) -> set[str]:
    """Every key of the schema that is a bounded number."""
    tables = [(name, one) for name, of in schema["$defs"].items() for one in (of, *of.get("oneOf", []))]
    return {
        f"{name}.{key}"
        for name, table in tables
        for key, node in table.get("properties", {}).items()
        if any(BOUNDS & variant.keys() for _, variant in variants(schema, node))
    }


def test_the_schema_and_the_reader_refuse_the_same_numbers(schema: Schema) -> None:
    judge = jsonschema.Draft202012Validator(schema)
    seen: set[str] = set()
    for tables in scenes():
        assert refusal(tables) == "" and judge.is_valid(tables), tables
        for path, name in set(numbers(schema, schema, tables)):
            if name in seen:
                continue
            seen.add(name)
            for value in TRIED:
                changed = with_value(tables, path, value)
                said, allowed = refusal(changed), judge.is_valid(changed)
                # A relation between two values is the reader's alone.
                agree = not any(words in said.split("\n")[0] for words in OF_ITSELF) if allowed else said
                assert agree, f"{name} at {path} = {value}: schema {allowed}, reader {said!r}"
    assert names(schema) <= seen, "a bounded key that no scene here names"
