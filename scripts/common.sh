# Sourced by the scripts that set a checkout up: install_packages, make_venv and build_workspace.

fail() { printf 'quad: %s\n' "$*" >&2; exit 1; }

checkout=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P)

# The path is in the first line of the nodes, which has no quotes, and in lists such as PATH.
case $checkout in
*[[:space:]:\;\"\'\$\\]*) fail "$checkout: a path with a space, a quote or one of : ; \$ \\ in it," \
    "which the first lines of scripts and lists of paths do not survive; move the checkout to" \
    "another folder, or install quad without ROS: pip install ." ;;
esac

# lock FOLDER: set-ups that work there take turns. Without flock (macOS), or where the file system has
# no locks, they do not.
lock() {
    exec 9<"$1"
    command -v flock >/dev/null || return 0
    flock --nonblock 9 2>/dev/null && return
    [ $? -eq 1 ] || return 0
    echo "quad: waiting for another set-up that works in $1; it can take minutes"
    flock 9
}

# require_writable FOLDER: before something is made there.
require_writable() {
    [ -w "$1" ] || fail "$(cd "$1" && pwd -P): cannot be written by $(id -un), and its set-up is not complete;" \
        "its owner runs the same command there first, or you clone the checkout into a folder of your own"
}

# start_clock: shows on a terminal, until the script ends, how long the rest of it has taken.
start_clock() {
    [ -t 1 ] || return 0
    local start=$SECONDS
    while sleep 1 && kill -0 $$ 2>/dev/null; do
        printf '\r%d:%02d ' $(((SECONDS - start) / 60)) $(((SECONDS - start) % 60))
    done 9<&- &
    trap "kill $! 2>/dev/null; printf '\r      \r'" EXIT
}
