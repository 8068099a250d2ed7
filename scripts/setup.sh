#!/bin/sh
# Prepare a checkout: system libraries where we may install them, and a Python environment in .venv.
# Usage: setup.sh run|dev      `run` is what the demo needs, `dev` adds the tools and oracles of the tests.
# Costs nothing when .venv already matches pyproject.toml.
set -eu
cd "$(dirname "$0")/.."

want=${1:-run}
stamp=.venv/.ready # "<run|dev> <checksum of pyproject.toml> <place>": a moved or copied environment is not ready
state="$(cksum <pyproject.toml) $PWD"

say() { echo "hybrid-dof: $*" >&2; }
fail() { say "$*"; exit 2; }

ready() {
    [ -f "$stamp" ] && { [ "$(cat "$stamp")" = "$want $state" ] || [ "$(cat "$stamp")" = "dev $state" ]; } || return 1
    .venv/bin/python -c 'import moderngl' 2>/dev/null
}

# ---- Python ---------------------------------------------------------------------------------------------------------

usable() { command -v "$1" >/dev/null 2>&1 && "$1" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; }

find_python() { # the first Python >= 3.11; $PYTHON, when given, goes first
    for python in "${PYTHON:-python3}" python3 python3.14 python3.13 python3.12 python3.11; do
        if usable "$python"; then echo "$python"; return; fi
    done
    return 1
}

has_venv() { "$1" -c 'import ensurepip, venv' 2>/dev/null; }

# ---- system packages ------------------------------------------------------------------------------------------------

missing_packages() { # Debian's names for what is not there; $1: a Python to ask the loader with
    [ "$(uname -s)" = Linux ] || return 0
    "$1" - <<'EOF'
import ctypes
for library, package in (("libEGL.so.1", "libegl1"), ("libGL.so.1", "libgl1 libglx-mesa0 libgl1-mesa-dri"),
                         ("libX11.so.6", "libx11-6"), ("libXext.so.6", "libxext6"), ("libXrandr.so.2", "libxrandr2"),
                         ("libXinerama.so.1", "libxinerama1"), ("libXi.so.6", "libxi6"), ("libstdc++.so.6", "libstdc++6")):
    try:
        ctypes.CDLL(library)
    except OSError:
        print(package)
EOF
    has_venv "$1" || echo python3-venv
    if [ "$want" = dev ]; then # the window tests open a real window on a virtual display
        command -v Xvfb >/dev/null || echo xvfb
        command -v xdotool >/dev/null || echo xdotool
    fi
}

install_packages() { # as root on Debian and its kin, else say which command does it
    if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
        say "installing $*"
        export DEBIAN_FRONTEND=noninteractive
        { apt-get -qq update; apt-get -qq install --no-install-recommends "$@"; } >/dev/null </dev/null ||
            say "apt-get could not install $*: going on without"
    else
        say "missing on this system, install with: sudo apt-get install $* (or your system's equivalent)"
    fi
}

# ---- environment ----------------------------------------------------------------------------------------------------

make_environment() {
    # A half-made environment (no pip, interrupted, its Python gone) is made again from nothing.
    .venv/bin/python -c 'import pip, sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || "$1" -m venv --clear .venv
    say "installing Python packages into .venv (a few minutes the first time)"
    extras=dev
    [ "$want" = dev ] || extras=exr,metrics,plots
    .venv/bin/python -m pip install -qq --disable-pip-version-check --no-input --editable ".[$extras]" </dev/null
}

case $want in run | dev) ;; *) fail "setup.sh takes run or dev, not '$want'" ;; esac
ready && exit 0
python=$(find_python) || fail "needs Python 3.11 or newer: install it, or name one with PYTHON=/path/to/python3"
missing=$(missing_packages "$python" | tr '\n' ' ')
# shellcheck disable=SC2086  # one word per package
[ -z "$missing" ] || install_packages $missing
has_venv "$python" || fail "$python has no venv module: install python3-venv (Debian) or your system's equivalent"
make_environment "$python" || fail "the Python packages could not be installed: see pip's message above"
echo "$want $state" >"$stamp"
