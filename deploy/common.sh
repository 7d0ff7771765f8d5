# Sourced by the scripts beside it: where things are, how to say what happens, how to build.
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
build="${UNDERSTORY_BUILD:-$root/build/release}"
jobs="${UNDERSTORY_JOBS:-$(nproc)}"

say() { printf '== %s\n' "$*"; }
fail() { printf '%s: %s\n' "$(basename "$0")" "$*" >&2; exit 1; }

# build_all TARGET...: configures when needed and builds; quiet unless it fails.
build_all() {
  local start=$SECONDS
  mkdir -p "$(dirname "$build")"
  if [ ! -f "$build/build.ninja" ]; then
    say "configure ($build)"
    cmake -S "$root" -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DUNDERSTORY_UNITY=ON \
      "-DUNDERSTORY_WERROR=${UNDERSTORY_WERROR:-OFF}" > "$build.configure.log" 2>&1 ||
      { tail -n 30 "$build.configure.log" >&2; fail "configuring failed"; }
  fi
  say "build with $jobs jobs (from nothing ten minutes and more on two cores, seconds when nothing changed)"
  ninja -C "$build" -j "$jobs" "$@" || fail "the build failed"
  say "built in $((SECONDS - start)) s"
}
