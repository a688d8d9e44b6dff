"""Reverse proxies as gateway-config/proxies/ describes them, started on free ports."""
import os
import pathlib
import re
import shutil
import signal
import socket
import subprocess

from processes import ROOT, Background, free_port

CONFIGS = ROOT / "gateway-config" / "proxies"
PROXIES = {"nginx": "nginx.conf", "caddy": "Caddyfile", "haproxy": "haproxy.cfg", "httpd": "httpd.conf"}
UNPACKED = ROOT / "build" / "deps" / "proxies"

NGINX = """
daemon off;
{user}
pid {folder}/nginx.pid;
error_log stderr;
worker_processes 1;
events {{ worker_connections 256; }}
http {{
    access_log off;
    client_body_temp_path {folder}/body;
    proxy_temp_path {folder}/proxy;
    fastcgi_temp_path {folder}/fastcgi;
    uwsgi_temp_path {folder}/uwsgi;
    scgi_temp_path {folder}/scgi;
{snippet}
}}
"""

CADDY = """
{{
	admin localhost:{admin}
	auto_https off
}}
{snippet}
"""

HTTPD = """
ServerRoot {folder}
ServerName localhost
PidFile {folder}/httpd.pid
ErrorLog /dev/stderr
{modules}
{snippet}
"""
HTTPD_MODULES = ("mpm_event", "authz_core", "alias", "headers", "proxy", "proxy_http")


def program(name):
    """Installed, or unpacked from Debian's package beside the other dependencies (./dev test interop)."""
    path = os.environ["PATH"] + ":/usr/sbin"
    for folder in ("usr/sbin", "usr/bin"):
        path += f":{UNPACKED / folder}"
    found = shutil.which(name, path=path)
    assert found, f"{name} is missing: ./dev test interop brings it"
    return found


class ReverseProxy:
    """One proxy before a gateway; `root` is the port of its site at "/", `below` of the one at "/robots/". `ports` are
    further ones of the file, and what stands for each."""

    def __init__(self, name, config, folder, gateway_port=8080, ports={}):
        self.name = name
        self.folder = pathlib.Path(folder)
        self.root, self.below = free_port(), free_port()
        text = (CONFIGS / config).read_text()
        for port, ours in {8080: gateway_port, 8081: self.root, 8082: self.below, **ports}.items():
            text = re.sub(rf"\b{port}\b", str(ours), text)
        self._admin = free_port()
        self.file = self.folder / pathlib.Path(config).name
        self.file.write_text(self._whole(text))
        self._process = Background(self._command(), self.folder / f"{name}.log", {"HOME": str(self.folder)})
        try:
            self._process.wait_until(lambda: is_open(self.root))
        except BaseException:
            self.stop()
            raise

    def _whole(self, snippet):
        if self.name == "nginx":
            return NGINX.format(user="user root;" if os.getuid() == 0 else "", folder=self.folder, snippet=snippet)
        if self.name == "caddy":
            return CADDY.format(admin=self._admin, snippet=snippet)
        if self.name == "httpd":
            modules = "\n".join(f"LoadModule {name}_module /usr/lib/apache2/modules/mod_{name}.so" for name in HTTPD_MODULES)
            if os.getuid() == 0:
                modules += "\nUser www-data\nGroup www-data"
            return HTTPD.format(folder=self.folder, modules=modules, snippet=snippet)
        # A second of silence ends what no longer timeout of its own holds, as those of WebSockets and slow answers.
        return re.sub(r"timeout (client|server) +30s", r"timeout \1 1s", snippet)

    def _command(self):
        return {
            "nginx": lambda: [program("nginx"), "-p", self.folder, "-c", self.file],
            "caddy": lambda: [program("caddy"), "run", "--config", self.file, "--adapter", "caddyfile"],
            # The master-worker mode is the one that reloads.
            "haproxy": lambda: [program("haproxy"), "-W", "-db", "-f", self.file],
            "httpd": lambda: [program("apache2"), "-DFOREGROUND", "-d", self.folder, "-f", self.file],
        }[self.name]()

    def reload(self):
        """As an operator does it."""
        if self.name == "caddy":
            subprocess.run([program("caddy"), "reload", "--force", "--config", self.file, "--adapter", "caddyfile",
                            "--address", f"localhost:{self._admin}"],
                           check=True, capture_output=True, timeout=30, env={**os.environ, "HOME": str(self.folder)})
        else:
            number = {"nginx": signal.SIGHUP, "haproxy": signal.SIGUSR2, "httpd": signal.SIGUSR1}[self.name]
            self._process.process.send_signal(number)

    @property
    def pid(self):
        """Of the first of its processes, and of their group."""
        return self._process.process.pid

    def description(self):
        return self._process.description()

    def stop(self):
        self._process.stop()


def is_open(port):
    try:
        socket.create_connection(("127.0.0.1", port), 1).close()
        return True
    except OSError:
        return False
