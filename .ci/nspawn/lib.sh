# Shared by the scripts that boot machines, after .ci/lib.sh.

# Sets PACKAGE to the package that .ci/package made and TREE to the Debian that machines begin with, which is
# kept in ${XDG_CACHE_HOME:-~/.cache}/trusswatch (debootstrap, a minute and a half); or ends the script with a
# word on why WHAT cannot be tried here.
machines_for() {
  local what=$1 try
  PACKAGE=$(ls target/debian/trusswatch_*.deb 2>/dev/null) || skip "$what" "there is no package"
  [ "$(id -u)" = 0 ] || skip "$what" "needs root"
  command -v apt-get >/dev/null || skip "$what" "needs Debian's packages"
  if ! command -v systemd-nspawn >/dev/null || ! command -v debootstrap >/dev/null || ! command -v ip >/dev/null; then
    apt-get update --quiet >/dev/null
    DEBIAN_FRONTEND=noninteractive apt-get install --yes --quiet --no-install-recommends \
      systemd-container debootstrap iproute2 >/dev/null
  fi
  # A container needs what a sandbox may withhold.
  try=$(mktemp -d)
  unshare --mount --net --pid --uts --ipc --fork mount -t tmpfs none "$try" 2>"$WORK/unshare" \
    || skip "$what" "no namespaces or mounts here: $(cat "$WORK/unshare")"
  rmdir "$try"
  TREE=$(python3 .ci/nspawn/debian.py 2>"$WORK/debootstrap.log") || { tail -n 20 "$WORK/debootstrap.log" >&2; exit 1; }
  echo "Debian is in $TREE ($SECONDS s)"
}

skip() {
  echo "$1: $2" | tee -a "$SKIPPED"
  exit 0
}

# Runs a command in a network of its own, whatever rules for packets the host has.
in_own_network() {
  PYTHONDONTWRITEBYTECODE=1 PYTHONPATH=deploy/compose unshare --net -- bash -c 'ip link set lo up && exec "$@"' - "$@"
}
