#!/bin/sh
# make_root.sh SOURCE ROOT    puts into ROOT what the image is made of: programs, page, documentation, libraries, a configuration
set -eu
source=$1
root=$2
prebuilt=$source/docker/prebuilt

install_packages() {
  apt-get update
  apt-get install -y --no-install-recommends "$@"
}

if [ ! -x "$prebuilt/bin/rrgate" ]; then
  cd "$source"
  ./dev setup product
  ./dev build
  ./dev docs
  cmake --install build/release --prefix "$prebuilt" --strip
fi

mkdir -p "$root/usr/libexec" "$root/etc/rrgate" "$root/tmp"
chmod 1777 "$root/tmp"
# What a gateway writes, for volumes: a new one takes owner and mode from here.
install -d -o 10001 -g 10001 -m 0750 "$root/var/lib/rrgate" "$root/var/log/rrgate"
install -D "$prebuilt/bin/rrgate" "$root/usr/bin/rrgate"
cp -r "$prebuilt/libexec/rrgate" "$root/usr/libexec/rrgate"
cp -r "$prebuilt/share" "$root/usr/share"
cp "$source/docker/gateway.json" "$root/etc/rrgate/gateway.json"
echo 'rrgate:x:10001:10001::/:/nonexistent' >"$root/etc/passwd"
echo 'rrgate:x:10001:' >"$root/etc/group"

# The CAs that every Debian trusts: SSL_CERT_FILE names them.
cas=/usr/share/ca-certificates/mozilla
[ -d "$cas" ] || install_packages ca-certificates
mkdir -p "$root/etc/ssl/certs"
cat "$cas"/*.crt >"$root/etc/ssl/certs/ca-certificates.crt"

programs="$root/usr/bin/rrgate $root/usr/libexec/rrgate/*"
if ldd $programs | grep -q 'not found'; then
  install_packages libjpeg62-turbo libqrencode4 libspdlog1.10 libssl3 libusb-1.0-0 zlib1g
fi
ldd $programs | sed -n 's|.*=> \(/[^ ]*\) .*|\1|p; s|^[[:space:]]*\(/[^ ]*ld-linux[^ ]*\) .*|\1|p' | sort -u |
  while read -r library; do
    mkdir -p "$root$(dirname "$library")"
    cp -L "$library" "$root$library"
  done
