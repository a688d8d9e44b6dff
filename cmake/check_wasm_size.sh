#!/usr/bin/env bash
# Adds up what a page has to load of a built client package (.wasm and .js, after brotli) and holds it to the budget.
# Usage: check_wasm_size.sh DIRECTORY [LIMIT_KB]
set -euo pipefail

directory=$1
limit=$((${2:-150} * 1024))
total=0
mapfile -t files < <(find "$directory" -type f \( -name '*.wasm' -o -name '*.js' -o -name '*.mjs' \) | sort)
((${#files[@]} > 0)) || { echo "check_wasm_size: no .wasm or .js in $directory" >&2; exit 1; }

for file in "${files[@]}"; do
  raw=$(stat -c %s "$file")
  packed=$(brotli --quality=11 --stdout "$file" | wc -c)
  total=$((total + packed))
  printf '%9d bytes, %8d after brotli  %s\n' "$raw" "$packed" "${file#"$directory"/}"
done
printf '%9s %16d after brotli, limit %d\n' total "$total" "$limit"
((total <= limit)) || { echo "check_wasm_size: $((total - limit)) bytes over the limit" >&2; exit 1; }
