#!/usr/bin/env bash
# The recording of the terminal in README and book: `bash docs/trials/terminal.sh` writes docs/src/images/terminal.svg.
# Needs Python, npm and a built program (cargo build --release); asciinema records, svg-term draws.
set -euo pipefail
root="$(cd "$(dirname "$0")/../.." && pwd)"
program="${HOID_BINARY:-$root/target/release/hoid}"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/tools"
"$work/tools/bin/pip" install --quiet asciinema==2.4.0
npm install --silent --prefix "$work" svg-term-cli@2.1.1

cat > "$work/typed.sh" <<'TYPED'
typed() {
    printf '\033[1;32m$\033[0m '
    for ((i = 0; i < ${#1}; i++)); do printf '%s' "${1:i:1}"; sleep 0.03; done
    printf '\n'
    eval "$1"
    sleep "$2"
}
typed 'hoid simulate --condition C4 --seed 1 --out run.csv' 1
typed 'hoid identify run.csv --to 40 --controlled-element "90/(s(s+6))"' 6
clear
typed 'hoid track run.csv --nk 29 --out trace.csv' 6
TYPED

mkdir "$work/bin"
ln -s "$program" "$work/bin/hoid"
cd "$work"
PATH="$work/bin:$PATH" TERM=xterm-256color "$work/tools/bin/asciinema" rec -q --overwrite --cols 84 --rows 34 -c "bash typed.sh" run.cast < /dev/null
"$work/node_modules/.bin/svg-term" --in run.cast --out "$root/docs/src/images/terminal.svg" --window --width 84 --height 34
echo "docs/src/images/terminal.svg: $(wc -c < "$root/docs/src/images/terminal.svg") bytes"
