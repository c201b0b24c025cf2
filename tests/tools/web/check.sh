#!/usr/bin/env bash
# check.sh [COUNT]: builds the browser's module, compares the bits of every scene in Node with those of the
# native program, and opens COUNT scenes with mistakes (10,000), none of which may trap.
set -euo pipefail
cd "$(dirname "$0")/../../.."
command -v node >/dev/null || { echo "the browser's build is not tested here: it needs Node"; exit 0; }
if ! rustup target add wasm32-unknown-unknown >/dev/null 2>&1; then
    echo "the browser's build is not tested here: rustup cannot add wasm32-unknown-unknown"
    exit 0
fi
tests/tools/web.sh
bits=$PWD/target/web/bits
rm -rf "$bits" && mkdir -p "$bits"
PLIANT_BITS=$bits cargo test --locked --test pliant -- --ignored positions_are_written_for_the_browser
node tests/tools/web/bits.mjs target/web/pliant.wasm scenes "$bits"
node tests/tools/web/session.mjs target/web/pliant.wasm scenes/cantilever_fem_2d.toml target/web/run.mcap
cargo run --locked --quiet --profile test -- info target/web/run.mcap
node tests/tools/web/fuzz.mjs target/web/pliant.wasm scenes "${1:-10000}"
