# shellcheck shell=bash
# Shared by the scripts that boot machines, after .ci/lib.sh.

# Sets PACKAGE to the package that .ci/package made and TREE to the Debian that machines begin with; or ends the
# script because WHAT cannot be tried here.
machines_for() {
  local what=$1 try
  # shellcheck disable=SC2034 # for those who source this
  PACKAGE=$(ls target/debian/trusswatch_*.deb 2>/dev/null) || cannot "$what" "there is no package"
  [ "$(id -u)" = 0 ] || cannot "$what" "needs root"
  needs "$what" machines
  TREE=$(tail -n 1 "$TOOLS_LOG")
  # A container needs what a sandbox may withhold.
  try=$(mktemp -d)
  unshare --mount --net --pid --uts --ipc --fork mount -t tmpfs none "$try" 2>"$WORK/unshare" \
    || cannot "$what" "no namespaces or mounts here: $(cat "$WORK/unshare")"
  rmdir "$try"
  echo "Debian is in $TREE ($SECONDS s)"
}

# Runs a command in a network of its own, independent of the host's packet filter.
in_own_network() {
  PYTHONPATH=deploy/compose unshare --net -- bash -c 'ip link set lo up && exec "$@"' - "$@"
}
