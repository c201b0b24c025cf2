#!/usr/bin/env bash
# The folder of the browser build in a real headless Chromium: site.sh SITE [FOLDER].
# SITE is what `tests/tools/web.sh` wrote, FOLDER (target/ci/site) takes screenshots and what npm installs.
# CHROMIUM names another browser than the one that npm brings.
set -euo pipefail
site=$(realpath "$1")
root=$(realpath "$(dirname "$0")/../../..")
folder=${2:-$root/target/ci/site}
mkdir -p "$folder"
cd "$folder"
cp "$root"/tests/tools/view_page/{package.json,browser.mjs} "$root"/tests/tools/web/site.mjs .
npm install --silent --no-audit --no-fund
node site.mjs "$site" pictures
