#!/usr/bin/env bash
# Exported .glb files in Khronos' validator: check_gltf.sh PLIANT [FOLDER]. PLIANT is the program, FOLDER
# (target/ci/gltf) takes recordings, exports and what npm installs.
set -euo pipefail
pliant=$(realpath "$1")
root=$(realpath "$(dirname "$0")/../..")
folder=${2:-$root/target/ci/gltf}
mkdir -p "$folder"
cd "$folder"
cp "$root"/tests/tools/gltf/{package.json,validate.mjs} .
npm install --silent --no-audit --no-fund
rm -f ./*.glb
# A solid, a plane body, strands, and particles.
for name in bunny cantilever_fem_2d hair galaxy; do
    "$pliant" run "$root/scenes/$name.toml" -o "$name.mcap" --until 0.2 --force --quiet
    "$pliant" export "$name.mcap" --to "$name.glb" --quiet
    "$pliant" export "$name.mcap" --to "$name-quantised.glb" --quantised --quiet
done
node validate.mjs ./*.glb
