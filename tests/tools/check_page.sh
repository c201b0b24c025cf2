#!/usr/bin/env bash
# The pages of `pliant view` and `pliant live` in a real headless Chromium: check_page.sh PLIANT [FOLDER].
# PLIANT is the program, FOLDER (target/ci/page) takes recordings, pages, screenshots and what npm installs.
# CHROMIUM names another browser than the one that npm brings.
set -euo pipefail
pliant=$(realpath "$1")
root=$(realpath "$(dirname "$0")/../..")
folder=${2:-$root/target/ci/page}
mkdir -p "$folder"
# Absolute, because the browser is given addresses of files in it.
folder=$(realpath "$folder")
cd "$folder"
cp "$root"/tests/tools/view_page/{package.json,{browser,view_page,live_page}.mjs,{two_bodies,live}.toml} .
npm install --silent --no-audit --no-fund
record() { "$pliant" run "$1" -o "$2.mcap" --force --quiet "${@:3}"; }
record two_bodies.toml two_bodies
record "$root/scenes/cantilever_fem_2d.toml" flat --until 0.5
record "$root/scenes/hair.toml" hair --until 0.5
for name in two_bodies flat hair; do
    "$pliant" view "$name.mcap" -o "$name.html" --no-open --force --quiet
done
node view_page.mjs "$folder"
node live_page.mjs "$pliant" "$folder"
