#!/usr/bin/env bash
# first_hour.sh
#
# Runs what a user does in the first hour with an own scene, world, map, robot and goals: one command
# for each, as in the documents. Flights with ROS have a roscore of their own. Ends at the first
# command that fails.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
export ROS_HOME=$out/ros_home ROS_LOG_DIR=$out/ros_home/log

quad() {
    echo "+ quad $*"
    .venv/bin/quad "$@" >"$out/log" 2>&1 || { local status=$?; cat "$out/log"; return $status; }
}

fly_with_ros() {
    echo "+ make fly ARGS=\"$*\""
    scripts/ros_env scripts/fly rviz:=false rate:=8 "$@" >"$out/log" 2>&1 ||
        { local status=$?; cat "$out/log"; return $status; }
}

# Before anything flies
quad preview --scene scenes/examples/workshop.yaml --goals goals/examples/workshop -o "$out/mission.png"
quad preview --robots 8 -o "$out/fleet.html"

# A map, whose costmap is a static layer; the tests of the documents fly the scene and the world
quad fly --scene scenes/examples/office.yaml --goals goals/examples/office

# Configurations of four robots: alternatives, other names, variants in folders, a launch file
for robot in compact:small outdoor/config:map service:tall field/launch/navigation.launch; do
    quad check "test/robots/$robot"
done
quad fly --config test/robots/field/launch/navigation.launch --goals goals/examples/arena
fly_with_ros config:="$PWD/test/robots/compact:small" goals:=goals/examples/arena

# Goals with yaws and stays
mkdir "$out/goals"
echo '{"goals": [[3.0, 4.5, 1.57], {"x": 3.0, "y": 6.5, "yaw": -1.57, "wait_s": 2}]}' \
    >"$out/goals/quad0_goals.json"
echo '{"goals": [[9.0, 3.5, 0.0], {"x": 9.0, "y": 5.0, "yaw": null}]}' >"$out/goals/quad1_goals.json"
quad fly --goals "$out/goals" --json "$out/yaws.json"

# Reports of a flight and of a comparison
quad fly --goals goals/examples/arena --record "$out/default.bag" --report "$out/default.html"
quad fly --goals goals/examples/arena --config tutorial --record "$out/tutorial.bag"
quad report "$out/default.bag" "$out/tutorial.bag" -o "$out/comparison.html" --pictures "$out/pictures"
for file in mission.png fleet.html yaws.json default.html comparison.html pictures; do
    [ -s "$out/$file" ] || { echo "quad: $file was not written" >&2; exit 1; }
done

# A package of your own: a node that imports quad_nav, and a rostest that flies. As the user has it, with
# the system's Python and without our virtual environment.
with_ros() {
    echo "+ $*"
    env -u PYTHONPATH PATH=/usr/bin:/bin ROS_HOSTNAME=localhost bash -c \
        'source "$0/setup.bash"; "$@"' "$space" "$@" >"$out/log" 2>&1 ||
        { local status=$?; cat "$out/log"; return $status; }
}
mkdir -p "$out/ws/src"
cp -r test/own_package "$out/ws/src/my_drones"
space=.ws/devel with_ros catkin_make --directory "$out/ws"
space=$out/ws/devel with_ros rostest my_drones mission.test
echo "quad: the first hour works"
