"""A QEMU guest with Debian's kernel, by software alone: what it starts with, and how it is started."""
import gzip
import os
import pathlib
import shutil
import subprocess
import tempfile

KERNEL = pathlib.Path(__file__).resolve().parents[2] / "build/deps/linux"  # ./dev test made it

BEGIN = r"""#!/bin/busybox sh
/bin/busybox --install -s /bin; export PATH=/bin
mount -t proc p /proc; mount -t sysfs s /sys; mount -t devtmpfs d /dev
while read module; do insmod /modules/$module || echo "insmod: $module"; done < /modules/order
"""


def find_kernel(folder=KERNEL):
    """Its image and its version. `folder` has boot/vmlinuz-* and lib/modules/* of Debian's linux-image package."""
    image = sorted((folder / "boot").glob("vmlinuz-*"))[-1]
    version = image.name.removeprefix("vmlinuz-")
    if not (folder / "lib/modules" / version / "modules.dep.bin").exists():
        subprocess.run(["/sbin/depmod", "-b", folder, version], check=True)
    return image, version


def make_initrd(path, init, modules, folder=KERNEL, given=None):
    """busybox, the modules in the order in which they have to be loaded, an /init that loads them and goes on with `init`, and what
    the guest is given."""
    version = find_kernel(folder)[1]
    with tempfile.TemporaryDirectory() as scratch:
        tree = pathlib.Path(scratch)
        for name in ("bin", "proc", "sys", "dev", "host", "modules"):
            (tree / name).mkdir()
        shutil.copy("/bin/busybox", tree / "bin/busybox")
        if given:
            shutil.copytree(given, tree / "given")
        (tree / "init").write_text(BEGIN + init)
        (tree / "init").chmod(0o755)
        order = []
        for module in modules:
            shown = subprocess.run(["/sbin/modprobe", "-d", folder, "-S", version, "--show-depends", module], check=True,
                                   capture_output=True, text=True).stdout
            for line in shown.splitlines():
                word, _, file = line.strip().partition(" ")
                name = os.path.basename(file)
                if word == "insmod" and name not in order:
                    order.append(name)
                    shutil.copy(file, tree / "modules" / name)
        (tree / "modules/order").write_text("\n".join(order) + "\n")
        names = "\0".join(str(file.relative_to(tree)) for file in sorted(tree.rglob("*")))
        archive = subprocess.run(["cpio", "-o", "-H", "newc", "--quiet", "-0"], cwd=tree, input=names.encode(), check=True,
                                 stdout=subprocess.PIPE).stdout
    path.write_bytes(gzip.compress(archive, 1))


def qemu_command(initrd, share, *more, folder=KERNEL, is_writable=False, kernel_options=()):
    """What starts it: its console is standard output, the folder `share` its file system "host" by 9p."""
    # Software emulation always: where /dev/kvm exists it may still not work.
    return ["qemu-system-x86_64", "-accel", "tcg", "-M", "q35", "-cpu", "max", "-m", "512", "-smp", "1", "-nographic",
            "-no-reboot", "-nodefaults", "-serial", "stdio", "-monitor", "none", "-kernel", find_kernel(folder)[0], "-initrd", initrd,
            "-append", " ".join(("console=ttyS0", "panic=-1", "quiet", *kernel_options)),
            "-virtfs", f"local,path={share},mount_tag=host,multidevs=remap," +
            ("security_model=passthrough" if is_writable else "security_model=none,readonly=on"), *more]
