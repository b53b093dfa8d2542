# shellcheck shell=bash
# Shared by the scripts in this directory, which run in the repository's root.
export CARGO_TERM_COLOR=never PYTHONDONTWRITEBYTECODE=1
# Installed by `.ci/tools`, kept between runs.
export TOOLS=${XDG_CACHE_HOME:-$HOME/.cache}/trusswatch
export PATH=$TOOLS/bin:$TOOLS/python/bin:$PATH
WORK=$(mktemp -d)
STAGES=$WORK/stages
PASSED=

# stage NAME MINUTES COMMAND…: runs a stage of a check. The check ends if it fails or exceeds its time budget. With
# PASSED set to a directory, stages that passed before are skipped.
stage() {
  local name=$1 minutes=$2 began=$SECONDS code=0 row passed
  passed=${PASSED:+$PASSED/${name//[^A-Za-z0-9]/_}}
  shift 2
  [ ! -e "$passed" ] || { cat "$passed" >>"$STAGES"; return; }
  printf '\n== %s (at %d s)\n' "$name" "$SECONDS"
  timeout --kill-after=20 "${minutes}m" "$@" </dev/null || code=$?
  printf -v row '%-52s %5d s of %5d s' "$name" $((SECONDS - began)) $((60 * minutes))
  [ "$code" = 0 ] || { echo "$row  FAILED, exit code $code" >>"$STAGES"; exit 1; }
  echo "$row" | tee -a "$STAGES" >>"${passed:-/dev/null}"
}

# Prints a table of the stages' times at the end.
summary() {
  local code=$?
  [ ! -s "$STAGES" ] || { echo; cat "$STAGES"; printf '%-52s %5d s\n' "in all" "$SECONDS"; }
  rm -rf "$WORK"
  exit "$code"
}
trap summary EXIT
