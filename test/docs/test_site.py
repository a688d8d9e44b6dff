"""The site that `./dev docs` makes, as the gateway serves it."""
import html
import html.parser
import http.client
import json
import re
import subprocess
import urllib.parse

import pytest

from processes import BUILD, ROOT, Background, free_port, read_json

SITE = ROOT / "build" / "docs"


class Page(html.parser.HTMLParser):
    """What matters of a page: where it leads, what it loads, what it has inside."""

    def __init__(self, text):
        super().__init__()
        self.links, self.loads, self.inside, self.ids = [], [], [], set()
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        told = dict(attributes)
        self.ids.add(told.get("id"))
        if tag == "a" and "href" in told:
            self.links.append(told["href"])
        if tag in ("script", "img") and "src" in told or tag == "link":
            self.loads.append(told.get("src") or told["href"])
        if tag == "style" or "style" in told or tag == "script" and "src" not in told or any(name.startswith("on") for name in told):
            self.inside.append(self.get_starttag_text())


@pytest.fixture(scope="module")
def site():
    """Its pages, by their path below /docs/."""
    assert (SITE / "index.html").exists(), "there is no build/docs: ./dev docs makes it"
    return {str(path.relative_to(SITE)): Page(path.read_text()) for path in SITE.rglob("*.html")}


def test_nothing_stands_inside_of_a_page_and_nothing_comes_from_elsewhere(site):
    assert [(name, page.inside) for name, page in site.items() if page.inside] == []
    assert [(name, load) for name, page in site.items() for load in page.loads if not load.startswith("/docs/")] == []


def test_all_commands_have_a_place_in_the_reference(site):
    def commands_below(*words):
        text = subprocess.run([BUILD / "server" / "rrgate", *words, "--help"], capture_output=True, text=True, timeout=20, check=True).stdout
        names = re.findall(r"^  ([a-z][a-z-]+)  +[A-Z]", text, re.M)
        return [place for name in names for place in ["-".join(["rrgate", *words, name]), *commands_below(*words, name)]]

    places = commands_below()
    assert {"rrgate-ls", "rrgate-cert-ca", "rrgate-generate-ts"} <= set(places)
    assert set(places) <= site["reference/commands.html"].ids


def test_links_lead_to_pages_and_headings(site):
    assert [(name, link) for name, page in site.items() for link in page.links if not leads_somewhere(site, name, link)] == []


def leads_somewhere(site, name, link):
    url = urllib.parse.urlsplit(urllib.parse.urljoin(f"http://here/docs/{name}", link))
    if url.netloc != "here" or not url.path.startswith("/docs/"):
        return url.scheme in ("http", "https") and (url.netloc != "here" or url.path == "/")
    path = urllib.parse.unquote(url.path.removeprefix("/docs/"))
    if path == "" or path.endswith("/"):
        path += "index.html"
    return path in site and (not url.fragment or urllib.parse.unquote(url.fragment) in site[path].ids)


def test_the_reference_has_every_option_and_command(site):
    schema = json.loads((ROOT / "gateway-config/gateway.schema.json").read_text())
    text = (SITE / "reference/configuration.html").read_text()
    assert [name for name in schema["properties"] if f'id="{name.replace("$", "")}"' not in text] == []
    assert "unused_session_ms" in text and "opaque_rate" in text
    assert "rrgate check-config" in (SITE / "reference/commands.html").read_text()
    assert (SITE / "reference/rrgate-client/functions/connect.html").exists()
    exports = json.loads((ROOT / "wasm-client/package.json").read_text())["exports"]
    entries = {name[2:] for name, target in exports.items() if isinstance(target, dict)} - {"", "inline", "worker-thread"}
    assert {f"./{entry}/" for entry in entries} <= set(site["reference/rrgate-client/index.html"].links)
    assert [entry for entry in entries if f"reference/rrgate-client/{entry}/index.html" not in site] == []
    for page, names in {"device": ["make_generator_handler", "class Node", "class Service"], "client": ["async_connect", "class RemoteObject"],
                        "subscribe": ["subscribe_service", "class Discovery"], "gateway": ["class EmbeddedGateway"],
                        "beast": ["make_beast_stream"], "values": ["struct NodeId"]}.items():
        text = html.unescape(re.sub("<[^>]*>", "", (SITE / f"reference/cpp/{page}.html").read_text()))
        assert [name for name in names if name not in text] == [], page


@pytest.mark.parametrize("prefix", ["", "/robots/lab"])
def test_the_gateway_serves_it(site, tmp_path, prefix):
    port = free_port()
    (tmp_path / "site").mkdir()
    (tmp_path / "gateway.json").write_text(json.dumps({"listen": [f"127.0.0.1:{port}"], "devices": [], "web_root": "site",
                                                       "base_path": prefix}))
    gateway = Background([BUILD / "server" / "rrgate", "serve", "--config", tmp_path / "gateway.json"], tmp_path / "log")
    try:
        gateway.wait_until(lambda: read_json(f"http://127.0.0.1:{port}/readyz"))
        assert ask(port, prefix + "/docs")[:2] == (308, "docs/")
        loads = set()
        for path in ("/docs/", "/docs/start.html", "/docs/reference/rrgate-client/", "/docs/reference/cpp/client.html"):
            status, _, policy, text = ask(port, prefix + path)
            assert status == 200 and "script-src 'self' 'wasm-unsafe-eval'" in policy and "unsafe-inline" not in policy
            page = Page(text)
            assert [link for link in page.links if link.startswith("/") and not link.startswith(prefix + "/docs/")] == []
            loads |= set(page.loads)
        if prefix:  # what a script loads when it runs
            assert any(f'"{prefix}/docs/' in ask(port, load)[3] for load in loads if load.endswith(".js"))
        else:
            loads |= {load for page in site.values() for load in page.loads}
        assert len(loads) > 5 and [load for load in loads if ask(port, load)[0] != 200] == []
        assert ask(port, prefix + "/docs/nothing.html")[0] == 404
    finally:
        gateway.stop()


def ask(port, path):
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
    try:
        connection.request("GET", path)
        answer = connection.getresponse()
        text = answer.read().decode(errors="replace")
        return answer.status, answer.headers["Location"], answer.headers["Content-Security-Policy"], text
    finally:
        connection.close()
