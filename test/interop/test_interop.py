"""Every scenario in every direction, and what the peers agreed on."""
import pytest

from clients import check_all, client_url, run_client
from directions import LOCAL_URL, Direction, service_command
from processes import Background, start_gateway
from scenarios import FUNCTIONS, SCENARIOS
from tap import Tap


@pytest.mark.parametrize("scenario", SCENARIOS, ids=lambda scenario: scenario.name)
def test_scenario(link, chromium, scenario, carries):
    direction, _, port = link
    carries(direction.client, direction.service, *direction.schemes)
    check_all(scenario.steps, run_client(direction, port, scenario, chromium))


def test_our_local_service_through_the_gateway(tmp_path, own_local_folder, carries):
    """As direction ours-gateway-local-reference, which has all scenarios; the gateway's part does not depend on the service."""
    carries("ours", "ours", "rr+ws", "rr+local")
    direction = Direction("ours-gateway-local-ours", "ours", "gateway-ws-local", "ours", "v4")
    service = Background(service_command(direction, direction.level, "http://127.0.0.1"), tmp_path / "service.log")
    gateway = None
    try:
        service.next_line()
        gateway, port = start_gateway(tmp_path, LOCAL_URL)
        check_all(FUNCTIONS.steps, run_client(direction, port, FUNCTIONS))
    finally:
        if gateway:
            gateway.stop()
        service.stop()


@pytest.mark.direct
def test_agreed_level(link):
    """The level that the service was started with is the level on the wire."""
    direction, level, port = link
    tap = Tap(port)
    try:
        check_all(FUNCTIONS.steps, run_client(direction, tap.port, FUNCTIONS))
        assert tap.level() == level
    finally:
        tap.close()


@pytest.mark.pages
def test_pages_of_other_origins(link, chromium):
    """A page may connect where it is expected, and nowhere else; browsers do not tell it why."""
    direction, _, port = link
    request = {"url": client_url(direction, port), "steps": []}
    assert chromium.ask(request) == {"results": []}
    answer = chromium.ask({**request, "page": chromium.origin.replace("127.0.0.1", "localhost")})
    assert answer["connect_error"]["name"] == "RobotRaconteur.ConnectionError"
    assert f"could not connect to ws://127.0.0.1:{port}" in answer["connect_error"]["message"]
    assert "does not let pages of http://localhost:" in answer["connect_error"]["message"]
