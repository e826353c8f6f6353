#!/usr/bin/env bash
# The lines of other people that the page stands on: host/page/site/vendor, from npm packages pinned in package-lock.json.
#
#   host/page/vendor.sh           fetches them by npm, which checks the lock's hashes, and copies what is served
#   host/page/vendor.sh --check   compares what is committed with vendor.sha256; needs no network
set -euo pipefail
cd "$(dirname "$0")"

if [ "${1:-}" != --check ]; then
    scratch=$(mktemp -d)
    trap 'rm -rf "$scratch"' EXIT
    cp package.json package-lock.json "$scratch"
    (cd "$scratch" && npm ci --ignore-scripts --no-audit --no-fund --silent)
    uplot="$scratch/node_modules/uplot"
    install -m 644 "$uplot/dist/uPlot.esm.js" "$uplot/dist/uPlot.min.css" site/vendor/
    install -m 644 "$uplot/LICENSE" site/vendor/uPlot-LICENSE.txt
fi
sha256sum --check --strict --quiet vendor.sha256
[ "$(find site/vendor -type f | wc -l)" = "$(wc -l < vendor.sha256)" ] || { echo "site/vendor holds files that vendor.sha256 does not name" >&2; exit 1; }
echo "the vendored files are those of package-lock.json"
