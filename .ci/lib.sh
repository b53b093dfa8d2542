# Shared by the scripts beside this file.
export CARGO_TERM_COLOR=never
WORK=${WORK:-$(mktemp -d)}
SKIPPED=${SKIPPED:-$WORK/skipped}
export WORK SKIPPED
touch "$SKIPPED"

step() {
  printf '\n== %s (%s s)\n' "$1" "$SECONDS"
}

# Sets COMMAND to the shell command that follows the line `<!-- NAME command -->` in the README.
readme_command() {
  COMMAND=$(awk -v mark="<!-- $1 command -->" '
    $0 == mark { found = 1; next }
    found && /^```/ { if (inside) exit; inside = 1; next }
    inside { print }' README.md)
  if [ -z "$COMMAND" ]; then
    echo "the README has no \`$1 command\`" >&2
    exit 1
  fi
  printf '+ %s\n' "$COMMAND"
}
