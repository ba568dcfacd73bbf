#!/bin/sh
# Build ompl.cpp against an installed OMPL 1.5 or 1.6, as Debian 12 has it: apt-get install g++ pkg-config libompl-dev
# Usage: sh build_ompl.sh [FOLDER], where the program goes; by default beside this file.
set -eu
here=$(dirname "$0")
target=${1:-$here}/ompl
if ! pkg-config --exists ompl; then
    echo "OMPL is not installed: apt-get install libompl-dev pkg-config" >&2
    exit 1
fi
# (of Debian's flags, those of the folders alone: the others name what OMPL itself was linked with)
# shellcheck disable=SC2046
${CXX:-g++} -O2 -std=c++17 -o "$target" "$here/ompl.cpp" $(pkg-config --cflags-only-I ompl) -lompl
echo "$target"
