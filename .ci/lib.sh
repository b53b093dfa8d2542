# shellcheck shell=bash
# Shared by the scripts beside this file.
export CARGO_TERM_COLOR=never PYTHONDONTWRITEBYTECODE=1
WORK=${WORK:-$(mktemp -d)}
SKIPPED=${SKIPPED:-$WORK/skipped}
# What is fetched or made once and kept from one run to the next.
TOOLS=${XDG_CACHE_HOME:-$HOME/.cache}/trusswatch
export WORK SKIPPED TOOLS
touch "$SKIPPED"

# Ends the script because WHAT cannot be tried on this machine, and prints WHY. With CI set, that is a
# failure; elsewhere it is listed at the end of the run.
cannot() {
  if [ -n "${CI:-}" ]; then
    echo "error: $1: $2; with CI set, a skipped check is a failure" >&2
    exit 1
  fi
  echo "skipped: $1: $2"
  echo "$1: $2" >>"$SKIPPED"
  exit 0
}

# Sees to it that these tools are there, by the names that `.ci/tools` knows; else WHAT cannot be tried. What
# that printed is in TOOLS_LOG, which no stage that runs beside this one writes.
needs() {
  local what=$1
  shift
  TOOLS_LOG=$WORK/tools.$$.log
  .ci/tools "$@" >"$TOOLS_LOG" 2>&1 || {
    cat "$TOOLS_LOG"
    cannot "$what" "$(tail -n 1 "$TOOLS_LOG")"
  }
}

# Sets COMMAND to the shell command that follows the line `<!-- NAME command -->` in one of the documents.
document_command() {
  local documents
  mapfile -t documents < <(git ls-files --cached --others --exclude-standard '*.md')
  COMMAND=$(awk -v mark="<!-- $1 command -->" '
    $0 == mark { found = 1; next }
    found && /^```/ { if (inside) exit; inside = 1; next }
    inside { print }' "${documents[@]}")
  if [ -z "$COMMAND" ]; then
    echo "no document has a \`$1 command\`" >&2
    exit 1
  fi
  printf '+ %s\n' "$COMMAND"
}
