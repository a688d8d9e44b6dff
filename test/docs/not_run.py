"""Blocks of the pages that the tests do not run, each with the reason. (page, beginning of the block's first line)."""

COMMANDS = {
    ("docs/access.md", "# in /etc/rrgate"): "root of a Debian of its own: test/interop/test_package.py runs it",
    ("docs/access.md", "curl --cacert"): "a host of the lab: test/interop/test_package.py asks the same",
    ("docs/access.md", "curl -d '{\"name\""): "a gateway with users: test/interop/test_access.py asks the same",
    ("docs/audit.md", "rrgate audit"): "the log of a gateway that has run for hours: test/interop/test_audit.py reads one",
    ("docs/deploy.md", "apt install"): "installs a package: test/interop/test_package.py does",
    ("docs/deploy.md", "adduser"): "makes a user of this machine",
    ("docs/deploy.md", "docker build"): "takes a container engine: test/interop/test_container.py does it",
    ("docs/deploy.md", "./dev package image"): "the same",
    ("docs/device-author.md", "build-examples/web_server"): "test/interop/test_web_server.py runs it",
    ("docs/discovery.md", "install -d"): "makes folders of this machine's users: test/interop/test_local_discovery.py does it",
    ("docs/embedding.md", "build-examples/thermostat_gateway"): "test/examples/examples_test.py builds and runs it",
    ("docs/mcp.md", "curl -u root"): "takes an agent that asks: test/interop/test_mcp_commands.py has one",
    ("docs/start.md", "apt install"): "installs a package: test/interop/test_package.py does",
    ("docs/start.md", "docker build"): "takes a container engine: test/interop/test_container.py does it",
    ("docs/start.md", "./dev demo"): "builds everything; the test starts what came of it",
    ("docs/systems.md", "rrgate demo conference-room"): "goes on until it is ended: test/examples/systems/systems_test.py does it",
    ("docs/systems.md", "rrgate demo microassembly"): "the same",
    ("docs/systems.md", "rrgate demo webcams"): "takes cameras: test/examples/demo has simulated drivers, test/server/process_test.py pictures",
    ("docs/systems.md", "/usr/libexec/rrgate"): "takes a robot: test/examples/systems/systems_test.py has one of bytes",
    ("docs/tutorials/cpp-device.md", "./dev build"): "test/examples/examples_test.py builds and runs it",
    ("docs/tutorials/cpp-device.md", "build-examples/thermostat_client"): "test/examples/examples_test.py builds and runs it",
    ("docs/tutorials/cpp-device.md", "build-examples/thermostat_subscriber"): "test/examples/examples_test.py builds and runs it",
    ("docs/tutorials/page.md", "./dev build"): "builds everything; the test uses what came of it",
    ("docs/tutorials/page.md", "npm install"): "asks the package registry; the test puts the package where npm would",
    ("CONTRIBUTING.md", "./dev setup"): "runs the tests that this is one of",
    ("README.md", "apt install"): "installs a package: test/interop/test_package.py does",
    ("README.md", "./dev demo"): "builds everything; the test starts what came of it",
    ("README.md", "docker build"): "takes a container engine: test/interop/test_container.py does it",
}

# Output in which numbers are those of a run, not of the next.
NUMBERS_DIFFER = {("docs/command-line.md", "rrgate watch"): "counts what came within a time",
                  ("docs/recording.md", "rrgate record"): "the same"}
