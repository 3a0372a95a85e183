#!/usr/bin/env bash
# Screens of every page of the book: `bash docs/trials/screens.sh DIR [PAGE...]` builds it and writes DIR/PAGE-400.png, -1200.png and
# -dark.png for inspection, and lists the elements that are cut off: a page wider than the screen, a block or table that must be moved sideways at 1200
# pixels, a picture that is not there, a link to a heading that no page has. Needs mdbook, npm and Chromium.
set -euo pipefail
root="$(cd "$(dirname "$0")/../.." && pwd)"
out="$(mkdir -p "${1:?where to write}" && cd "$1" && pwd)"
shift
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
mdbook build "$root/docs" --dest-dir "$work/book"
npm install --silent --prefix "$work" playwright-core@1.65.1
cp "$root/docs/trials/screens.mjs" "$work/"
node "$work/screens.mjs" "$work/book" "$out" "$@"
