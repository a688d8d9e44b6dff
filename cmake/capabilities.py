#!/usr/bin/env python3
"""What tests need of a machine that not every machine has. This is the one place that asks for it.

capabilities.py --write FILE   asks, prints the list, and writes {name: null, or why this machine lacks it}
capabilities.py --list FILE    prints the list of such a file
capabilities.py --lacks NAME   prints why this machine lacks it and ends with 0; with 1 where it has it

./dev test asks once, before the first stage; RR_MACHINE names the file to all tests. A test without that file asks by itself.
"""
import argparse
import functools
import json
import os
import pathlib
import shutil
import subprocess
import sys

DEPS = pathlib.Path(__file__).resolve().parents[1] / "build" / "deps"


class Lacking(Exception):
    pass


def need_root():
    if os.geteuid() != 0:
        raise Lacking("this user is not root")


def need_programs(*names):
    for name in names:
        if not shutil.which(name, path=os.environ.get("PATH", os.defpath) + ":/usr/sbin:/sbin"):
            raise Lacking(f"there is no {name}")


def need_success(*command):
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    except (OSError, subprocess.TimeoutExpired) as problem:
        raise Lacking(f"{command[0]}: {problem}") from None
    if done.returncode != 0:
        words = (done.stderr or done.stdout).strip().splitlines() or [f"ended with {done.returncode}"]
        raise Lacking(f"{' '.join(command[:3])}: {words[-1]}")


def need_namespace_with(*commands):
    """Commands, each within a network namespace of its own."""
    need_root()
    need_programs("ip", "nsenter")
    name = f"rrgate-asks-{os.getpid()}"
    need_success("ip", "netns", "add", name)
    try:
        for command in commands:
            need_success("nsenter", f"--net=/run/netns/{name}", *command)
    finally:
        subprocess.run(["ip", "netns", "delete", name], capture_output=True, check=False)


def network():
    """Hosts of network namespaces on a bridge, with IPv6."""
    need_namespace_with(
        ("ip", "link", "add", "br0", "type", "bridge", "forward_delay", "0"), ("ip", "link", "set", "br0", "up"),
        ("ip", "link", "add", "port0", "type", "veth", "peer", "name", "port1"),
        ("ip", "link", "set", "port0", "master", "br0"), ("ip", "-6", "addr", "add", "fe80::77/64", "dev", "port1"))


def packet_loss():
    """iptables that drops some packets of a network namespace."""
    need_programs("iptables")
    need_namespace_with(("iptables", "-A", "OUTPUT", "-p", "tcp", "-m", "statistic", "--mode", "random", "--probability", "0.05",
                         "-j", "DROP"))


def mount_namespaces():
    """Mounts that only the own processes see."""
    need_root()
    need_programs("unshare")
    need_success("unshare", "-m", "--propagation", "private", "sh", "-c",
                 "mount -t tmpfs class /sys/class && mount --bind /dev/null /dev/full")


def containers():
    """Podman, and a base for images that came without a registry."""
    need_root()
    need_programs("podman", "crun", "unshare")
    if not (DEPS / "container-base.tar").exists():
        raise Lacking("there is no build/deps/container-base.tar, which mmdebstrap makes in ./dev test")
    need_success("unshare", "-m", "--propagation", "private", "sh", "-c",
                 "mount -t tmpfs o /mnt && mkdir /mnt/low /mnt/up /mnt/work /mnt/all && "
                 "mount -t overlay o -o lowerdir=/mnt/low,upperdir=/mnt/up,workdir=/mnt/work /mnt/all")


def image_debs():
    """Debian's packages of shared libraries, for images that are made without a registry."""
    if not (DEPS / "image-debs-amd64" / "complete").exists():
        raise Lacking("there are no packages in build/deps/image-debs-amd64, which mmdebstrap gets in ./dev test")


def debian_root():
    """A fresh Debian to install packages into, by root."""
    need_root()
    need_programs("chroot", "dpkg", "mknod", "tar")
    if not (DEPS / "package-base.tar").exists():
        raise Lacking("there is no build/deps/package-base.tar, which mmdebstrap makes in ./dev test")


def guest():
    """A virtual machine with a kernel that knows USB and FUSE: Debian's, in QEMU."""
    need_programs("qemu-system-x86_64", "cpio", "depmod", "modprobe", "busybox")
    if not (DEPS / "linux" / "complete").exists():
        raise Lacking("there is no kernel in build/deps/linux, which ./dev test gets from Debian")


def firefox():
    """Firefox of the long support, which Debian has."""
    need_programs("firefox-esr")


def webkit():
    """WebKitGTK: Epiphany on a display of its own, and its WebDriver."""
    need_programs("epiphany", "WebKitWebDriver", "xvfb-run", "xauth", "dbus-run-session")


def systemd():
    """systemd-analyze, which reads units."""
    need_programs("systemd-analyze")


def apparmor():
    """apparmor_parser, which reads profiles; no kernel with AppArmor is needed for that."""
    need_programs("apparmor_parser")


CAPABILITIES = {"network": network, "packet-loss": packet_loss, "mount-namespaces": mount_namespaces,
                "containers": containers, "debian-root": debian_root, "image-debs": image_debs, "guest": guest, "firefox": firefox, "webkit": webkit,
                "systemd": systemd, "apparmor": apparmor}


@functools.cache
def lacks(name):
    """Why this machine lacks it, None where it has it: as was written before, where it was."""
    if "RR_MACHINE" in os.environ:
        return json.loads(pathlib.Path(os.environ["RR_MACHINE"]).read_text(encoding="utf-8"))[name]
    return ask(name)


def ask(name):
    try:
        CAPABILITIES[name]()
    except Lacking as reason:
        return str(reason)
    return None


def format_list(machine):
    return "".join(f"  {name:<17} {'no: ' + reason if reason is not None else 'yes'}\n" for name, reason in machine.items())


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    action = parser.add_mutually_exclusive_group(required=True)
    action.add_argument("--write", type=pathlib.Path, metavar="FILE")
    action.add_argument("--list", type=pathlib.Path, metavar="FILE")
    action.add_argument("--lacks", choices=CAPABILITIES, metavar="NAME")
    arguments = parser.parse_args()
    if arguments.lacks:
        reason = lacks(arguments.lacks)
        print(reason or "")
        return 0 if reason is not None else 1
    if arguments.write:
        arguments.write.write_text(json.dumps({name: ask(name) for name in CAPABILITIES}), encoding="utf-8")
    print(format_list(json.loads((arguments.write or arguments.list).read_text(encoding="utf-8"))), end="")
    return 0


if __name__ == "__main__":
    sys.exit(main())
