#!/usr/bin/env bash
# quiet_rviz.sh COMMAND [ARGUMENT...]
#
# Runs RViz without the lines about packages that Debian does not have and RViz does not need, and
# about its OpenGL, and with a low priority: without a graphics card it takes all cores, and commands
# would come late.
read -r _ _ _ _ _ session _ </proc/$$/stat
if [ "$session" = $$ ]; then # as roslaunch starts it
    # Linux may share the processor between sessions; then only the session's own priority counts.
    { echo 10 >/proc/self/autogroup; } 2>/dev/null || true
fi
noise='media_export|\[librospack\]|XDG_RUNTIME_DIR'
noise+='|rviz/glsl|GLSL link result|active samplers with a different type'
exec nice -n 10 "$@" 2> >(exec grep --line-buffered -Ev "$noise" >&2)
