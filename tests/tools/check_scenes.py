"""Validates scene files against the JSON schema that `pliant schema` prints.

Usage: check_scenes.py SCHEMA.json SCENE.toml...
"""

import json
import sys
import tomllib

import jsonschema


def main(schema_path: str, scenes: list[str]) -> int:
    with open(schema_path, encoding="utf-8") as file:
        schema = json.load(file)
    validator = jsonschema.Draft202012Validator(schema)
    validator.check_schema(schema)
    failures = 0
    for path in scenes:
        with open(path, "rb") as file:
            scene = tomllib.load(file)
        for error in validator.iter_errors(scene):
            place = ".".join(str(part) for part in error.absolute_path)
            print(f"{path}: {place}: {error.message}")
            failures += 1
    print(f"{len(scenes)} scenes, {failures} violations of the schema")
    return 1 if failures or not scenes else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2:]))
