#!/usr/bin/env bash
# web.sh [--lecture] [-o DIR]: builds the browser's pliant into DIR (target/web/site): a folder of static
# files that any web server shows. The module alone is target/web/pliant.wasm. `--lecture` builds a smaller
# one without contact, membranes, elements of second order and most materials, into target/lecture/web.
#
# wasm-opt comes with npm (binaryen); without it the module is as the compiler leaves it. -Os takes four
# times as long as -O1.
set -euo pipefail
cd "$(dirname "$0")/../.."
site=target/web/site work=target/web
while [ $# -gt 0 ]; do
    case $1 in
        -o) site=$2; shift 2 ;;
        --lecture)
            # Flags of the environment take the place of those of `.cargo/config.toml`.
            export RUSTFLAGS="-C target-feature=+simd128 --cfg lecture" CARGO_TARGET_DIR=target/lecture
            work=target/lecture/web site=target/lecture/web/site
            shift ;;
        *) echo "usage: tests/tools/web.sh [-o DIR] [--lecture]" >&2; exit 2 ;;
    esac
done
target=wasm32-unknown-unknown
mkdir -p "$work"
rustup target add "$target" >/dev/null 2>&1 || true
cargo rustc --locked --profile web -p pliant-web --target "$target"
module=${CARGO_TARGET_DIR:-target}/$target/web/pliant_web.wasm
if command -v npm >/dev/null && [ ! -d "$work/node_modules/binaryen" ]; then
    npm install --silent --no-fund --no-audit --prefix "$work" binaryen@132 ||
        echo "npm has no binaryen here" >&2
fi
if [ -x "$work/node_modules/.bin/wasm-opt" ]; then
    "$work/node_modules/.bin/wasm-opt" -O1 --enable-simd --enable-bulk-memory \
        --enable-nontrapping-float-to-int --enable-sign-ext --enable-mutable-globals \
        --enable-multivalue --enable-reference-types \
        --strip-debug --strip-producers "$module" -o "$work/pliant.wasm"
else
    cp "$module" "$work/pliant.wasm"
fi
printf '%s: %d bytes, %d with gzip\n' "$work/pliant.wasm" "$(wc -c <"$work/pliant.wasm")" \
    "$(gzip -9 <"$work/pliant.wasm" | wc -c)"
if [ -f crates/web/site/make.mjs ] && command -v node >/dev/null; then
    program=()
    [ -x target/release/pliant ] && program=(target/release/pliant)
    node crates/web/site/make.mjs "$work/pliant.wasm" "$site" "${program[@]}"
fi
