# For the scripts beside: $source is the project, $folder a fresh one that is gone at the end.
set -euo pipefail
source=$(cd "$(dirname "$0")/../.." && pwd)
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

# check WHAT COMMAND...: runs the consumer COMMAND on all golden streams.
check() {
  local what=$1 name hash
  shift
  while read -r name hash _; do
    [ "$name" = "#" ] && continue
    "$@" "$source/tests/golden/$name.relief" "$folder/mesh"
    [ "$(sha256sum < "$folder/mesh")" = "$hash  -" ] || fail "$what: $name decodes to something else"
  done < "$source/tests/golden/golden.txt"
  echo "good: $what"
}

fail() {
  echo "$*" >&2
  exit 1
}
