#!/usr/bin/env bash
# Compiles core for the pages of `trainer render view`, and leaves it where the trainer takes it from:
# trainer/src/report/view/glimpse.wasm. It needs rustup's target wasm32-unknown-unknown, or what
# `tests/run firmware` installs instead.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"
. ../../tests/view.sh
view_build
cp target/wasm32-unknown-unknown/release/glimpse_view.wasm ../src/report/view/glimpse.wasm
chmod 644 ../src/report/view/glimpse.wasm
