#!/usr/bin/env python3
"""Breaks each rule of check_layers.py once, in a scratch tree, and sees it reported."""
import pathlib
import tempfile
import unittest

from check_layers import findings


class CheckLayers(unittest.TestCase):
    def report(self, path, text):
        with tempfile.TemporaryDirectory() as scratch:
            file = pathlib.Path(scratch, path)
            file.parent.mkdir(parents=True)
            file.write_text(text, encoding="utf-8")
            return list(findings(pathlib.Path(scratch)))

    def test_downward_includes_are_clean(self):
        self.assertEqual(self.report("core/types/pack.cpp", '#include "core/wire/message.hpp"\n#include <vector>\n'), [])
        self.assertEqual(self.report("server/main.cpp", '#include <boost/asio.hpp>\n#include "core/session/node.hpp"\n'), [])
        self.assertEqual(self.report("web/src/main.ts", 'import { connect } from "rrgate-client";\n'), [])

    def test_upward_include_names_file_line_and_layer(self):
        (found,) = self.report("core/wire/codec.cpp", '\n#include "core/types/value.hpp"\n')
        self.assertTrue(found.startswith("core/wire/codec.cpp:2: core/wire must not include"), found)

    def test_floors_hold_within_folders_too(self):
        self.assertEqual(len(self.report("core/robdef/model/a.hpp", '#include "core/robdef/parse/lexer.hpp"\n')), 1)
        self.assertEqual(len(self.report("node/transport/a.hpp", '#include "node/service/node.hpp"\n')), 1)
        self.assertEqual(len(self.report("server/upstream/a.hpp", '#include "server/http/endpoints/objects.hpp"\n')), 1)
        self.assertEqual(self.report("server/http/endpoints/a.hpp", '#include "server/upstream/device.hpp"\n'), [])

    def test_each_folder_has_a_floor(self):
        for path in ("core/fresh/a.hpp", "node/fresh/a.cpp", "server/fresh/a.hpp"):
            (found,) = self.report(path, "")
            self.assertIn("has no floor", found)
        for path in ("core/wire/fresh/a.hpp", "server/main.cpp", "server/http/fresh/a.hpp", "examples/fresh/a.cpp"):
            self.assertEqual(self.report(path, ""), [], path)

    def test_clients_and_services_do_not_see_each_other(self):
        self.assertEqual(len(self.report("node/service/a.hpp", '#include "node/client/client.hpp"\n')), 1)
        self.assertEqual(len(self.report("core/session/client/a.hpp", '#include "core/session/service/locks.hpp"\n')), 1)

    def test_nodes_do_not_see_the_gateway(self):
        self.assertEqual(len(self.report("node/service/a.hpp", '#include "server/log/log.hpp"\n')), 1)
        self.assertEqual(len(self.report("examples/demo/a.cpp", '#include "server/log/log.hpp"\n')), 1)

    def test_examples_see_public_headers_alone(self):
        self.assertEqual(self.report("examples/demo/a.cpp", '#include "rrgate/device.hpp"\n'), [])
        for header in ("node/service/node.hpp", "core/session/url.hpp"):
            self.assertEqual(len(self.report("examples/demo/a.cpp", f'#include "{header}"\n')), 1, header)

    def test_core_does_no_input_or_output(self):
        for header in ("<boost/asio/ip/tcp.hpp>", "<openssl/ssl.h>", "<thread>", "<mutex>", "<sys/socket.h>"):
            self.assertEqual(len(self.report("core/session/a.cpp", f"#include {header}\n")), 1, header)

    def test_core_does_not_see_nodes_or_the_server(self):
        self.assertEqual(len(self.report("core/wire/a.hpp", '#include "node/driver/accept.hpp"\n')), 1)
        self.assertEqual(len(self.report("core/wire/a.hpp", '#include "server/log/log.hpp"\n')), 1)

    def test_client_does_not_see_the_server(self):
        self.assertEqual(len(self.report("wasm-client/src/a.cpp", '#include "server/log/log.hpp"\n')), 1)

    def test_page_imports_the_public_entry_only(self):
        for imported in ("rrgate-client/dist/connection.js", "../../wasm-client/ts/index"):
            self.assertEqual(len(self.report("web/src/a.tsx", f'import {{ x }} from "{imported}";\n')), 1, imported)


if __name__ == "__main__":
    unittest.main()
