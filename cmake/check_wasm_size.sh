#!/usr/bin/env bash
# Adds up what a page has to load of a built client package (.wasm and .js, after brotli) and holds it to the budgets:
# one for what every page loads, and one each for what it loads when it wants it: usb/ for a USB device, lease/ for a lease,
# serve/ to be a device, losses/ to ask what was lost, definition/ for a definition, services/ to look for services, worker/ to
# have it all in a worker, and what it has of a framework.
# Usage: check_wasm_size.sh DIRECTORY [LIMIT_KB [USB_LIMIT_KB]]
set -euo pipefail

directory=$1

check() {  # name limit_kb file...
  local name=$1 limit=$(($2 * 1024)) total=0 file raw packed
  shift 2
  (($# > 0)) || { echo "check_wasm_size: no .wasm or .js of the $name in $directory" >&2; return 1; }
  for file in "$@"; do
    raw=$(stat -c %s "$file")
    packed=$(brotli --quality=11 --stdout "$file" | wc -c)
    total=$((total + packed))
    printf '%9d bytes, %8d after brotli  %s\n' "$raw" "$packed" "${file#"$directory"/}"
  done
  printf '%9s %16d after brotli, limit %d: the %s\n' total "$total" "$limit" "$name"
  ((total <= limit)) || { echo "check_wasm_size: the $name is $((total - limit)) bytes over the limit" >&2; return 1; }
}

find_files() {
  find "$directory" -type f \( -name '*.wasm' -o -name '*.js' -o -name '*.mjs' \) "$@" | sort
}

# Nobody loads inline.js and rrgate.wasm, and internal.js is not published; nor is worker/host.js, which only that loads.
mapfile -t files < <(find_files -not -path "$directory/usb/*" -not -path "$directory/lease/*" -not -path "$directory/definition/*" \
  -not -path "$directory/services/*" -not -path "$directory/serve/*" -not -path "$directory/losses/*" -not -path "$directory/stores/*" \
  -not -path "$directory/worker/*" -not -path "$directory/react/*" -not -path "$directory/svelte/*" -not -path "$directory/vue/*" -not -name inline.js -not -name internal.js \
  -not -name thread.js -not -name worker.js -not -name worker_thread.js)
mapfile -t usb_files < <(find_files -path "$directory/usb/*")
mapfile -t definition_files < <(find_files -path "$directory/definition/*")
mapfile -t serve_files < <(find_files -path "$directory/serve/*")
mapfile -t service_files < <(find_files -path "$directory/services/*")
mapfile -t framework_files < <(for name in stores react svelte vue; do find_files -path "$directory/$name/*"; done)
mapfile -t losses_files < <(find_files -path "$directory/losses/*")
mapfile -t lease_files < <(find_files -path "$directory/lease/*")
mapfile -t worker_files < <(find_files \( -path "$directory/worker/*" -o -name thread.js -o -name worker.js -o -name worker_thread.js \) -not -name host.js)
check client "${2:-120}" "${files[@]}"
check "USB part" "${3:-20}" "${usb_files[@]}"
check "part for leases" 2 "${lease_files[@]}"
check "part for services" 145 "${serve_files[@]}"
check "part for losses" 1 "${losses_files[@]}"
check "part for definitions" 2 "${definition_files[@]}"
check "part that finds services" 1 "${service_files[@]}"
check "part for workers" 10 "${worker_files[@]}"
check "parts for frameworks" 3 "${framework_files[@]}"
