# shellcheck shell=bash
# Runs the stages of a check, one after the other or in the background, and prints what each took. To be
# sourced after lib.sh.
#
#   stage NAME LIMIT COMMAND…    runs it; the check ends if it fails or takes longer than the limit
#   beside NAME LIMIT COMMAND…   begins it in the background, with what the stages leave of the processors
#   along NAME LIMIT COMMAND…    begins it in the background, as one of equal rights
#   joined NAME…                 waits for these; prints what they printed; ends the check if one failed
declare -A BESIDE_PID
STAGES=$WORK/stages
: >"$STAGES"

# Makes a directory for the files of one stage, so that none takes what another left for its own, and prints it.
room() {
  mkdir -p "$WORK/${1//[^A-Za-z0-9]/_}"
  echo "$WORK/${1//[^A-Za-z0-9]/_}"
}

took() {
  printf '%-44s %5d s  %s\n' "$1" "$2" "$3" >>"$STAGES"
}

fail() {
  echo "FAILED: $1 ($2)" >&2
  exit 1
}

why() {
  case $1 in
    124 | 137) echo "not within $2" ;;
    *) echo "exit code $1" ;;
  esac
}

stage() {
  local name=$1 limit=$2 began=$SECONDS code=0
  shift 2
  printf '\n== %s (at %d s)\n' "$name" "$SECONDS"
  timeout --kill-after=20 "$limit" env WORK="$(room "$name")" "$@" </dev/null || code=$?
  [ "$code" = 0 ] || { took "$name" $((SECONDS - began)) FAILED; fail "$name" "$(why "$code" "$limit")"; }
  took "$name" $((SECONDS - began)) ""
}

# What only computes: real-time tests must not feel it.
beside() {
  local name=$1 limit=$2
  shift 2
  along "$name" "$limit" chrt --idle 0 "$@"
}

along() {
  local name=$1 limit=$2 file=$WORK/beside.${1//[^A-Za-z0-9]/_}
  shift 2
  (
    began=$SECONDS code=0
    timeout --kill-after=20 "$limit" env WORK="$(room "$name")" "$@" </dev/null >"$file.log" 2>&1 || code=$?
    echo "$((SECONDS - began)) $code $(why "$code" "$limit")" >"$file.end"
  ) &
  BESIDE_PID[$name]=$!
}

joined() {
  local name file seconds code reason
  for name in "$@"; do
    file=$WORK/beside.${name//[^A-Za-z0-9]/_}
    local waited=$SECONDS
    wait "${BESIDE_PID[$name]}" || true
    unset "BESIDE_PID[$name]"
    read -r seconds code reason <"$file.end"
    printf '\n== %s (was beside for %d s)\n' "$name" "$seconds"
    cat "$file.log"
    [ "$code" = 0 ] || { took "$name" "$seconds" FAILED; fail "$name" "$reason"; }
    took "$name" "$seconds" "beside, waited for $((SECONDS - waited)) s"
  done
}

# Background stages end with the check.
finish() {
  local code=$? pid
  for pid in "${BESIDE_PID[@]}"; do
    pkill -TERM -P "$pid" 2>/dev/null || true
  done
  printf '\n%-44s %5s\n' stage time
  cat "$STAGES"
  printf '%-44s %5d s\n' total "$SECONDS"
  if [ -s "$SKIPPED" ]; then
    echo "skipped:"
    cat "$SKIPPED"
  else
    echo "skipped: nothing"
  fi
  exit "$code"
}
trap finish EXIT
