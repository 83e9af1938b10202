#!/usr/bin/env bash
# quiet_rviz.sh COMMAND [ARGUMENT...]
#
# Runs RViz without the lines about packages that Debian does not have and RViz does not need.
exec "$@" 2> >(exec grep --line-buffered -v -e media_export -e '\[librospack\]' -e 'XDG_RUNTIME_DIR' >&2)
