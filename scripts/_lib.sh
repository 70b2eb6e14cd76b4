# Shared by the scripts of this folder: to be sourced, not run.
# shellcheck shell=bash

ROOT=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P)
VENV=${PLATWRIGHT_VENV:-$ROOT/.venv}
PYTHON=$VENV/bin/python
# The interpreter that QGIS's Python bindings belong to; no other one can import them.
SYSTEM_PYTHON=/usr/bin/python3

say() { printf '%s\n' "$*" >&2; }
die() { say "$(basename "$0"): $*"; exit 1; }

# Name of the qgis_process program. Debian 12's wrapper of that name is broken, so its
# .bin is preferred.
qgis_program() {
    command -v qgis_process.bin || command -v qgis_process ||
        die "qgis_process is not installed: run scripts/setup."
}

site_packages() {
    "$PYTHON" -c 'import sysconfig; print(sysconfig.get_paths()["purelib"])'
}

# use_profile FOLDER: an isolated QGIS profile in FOLDER that sees this tree as its plugin.
use_profile() {
    local profile=$1
    mkdir -p "$profile/plugins" "$profile/config" "$profile/runtime"
    chmod 700 "$profile/runtime"
    ln -sfn "$ROOT" "$profile/plugins/platwright"
    export QGIS_PLUGINPATH=$profile/plugins QGIS_CUSTOM_CONFIG_PATH=$profile/config
    export XDG_RUNTIME_DIR=$profile/runtime QT_QPA_PLATFORM=offscreen
    export OMP_NUM_THREADS=${OMP_NUM_THREADS:-1}
    PLATWRIGHT_DEPS=$(site_packages)
    export PLATWRIGHT_DEPS
    unset PYTHONPATH
    # It fails where the plugin is enabled already, as on every second run.
    grep -qs '^platwright=true' "$profile"/config/profiles/default/QGIS/QGIS3.ini ||
        quiet "$(qgis_program)" plugins enable platwright
}

# quiet COMMAND...: run it and show what it said only if it fails.
quiet() {
    local log
    log=$(mktemp)
    if ! "$@" >"$log" 2>&1; then
        cat "$log" >&2
        rm -f "$log"
        die "failed: $*"
    fi
    rm -f "$log"
}
