#!/bin/sh
# release_notes.sh VERSION CHANGELOG.md    prints the changelog's section of a version, which is the text of its release. It fails where
# there is none, and where changes are listed as unreleased still: no release would tell of them.
set -eu

section() {  # heading, up to its "]"
  awk -v begin="## [$1]" 'index($0, "## [") == 1 { is_it = index($0, begin) == 1; next } is_it && !/^\[[^]]*\]: /' "$2"
}

fail() {
  echo "$2: $1" >&2
  exit 1
}

if section Unreleased "$2" | grep -q '[^[:space:]]'; then
  fail "expected no text below \"## [Unreleased]\": what is released stands below \"## [$1]\" (CONTRIBUTING.md)" "$2"
fi
section "$1" "$2" | grep -q '[^[:space:]]' || fail "found no text below \"## [$1]\", which is to be the text of the release" "$2"
section "$1" "$2"
