"""Bounds on how often and how much at once clients, users and all of a device may ask."""
import http.client
import json
import subprocess
import sys
import time

from access_gateways import json_socket, running
from http_api import BASE, ask
from users import basic, make_users


def test_rates(device, tmp_path):
    make_users(tmp_path)
    rates = {"user": {"per_second": 5}, "device": {"at_once": 2}}
    with running(tmp_path, device, {"users_file": "users"}, rates=rates) as gateway:
        answers = [ask(gateway.port, "GET", BASE + "/p_double", headers=basic("alice")) for _ in range(40)]
        statuses = {answer.status for answer in answers}
        assert statuses == {200, 429}
        assert next(answer for answer in answers if answer.status == 429).headers["Retry-After"] == "1"
        assert ask(gateway.port, "GET", BASE + "/p_double", headers=basic("vera")).status == 200
        streams = []
        for _ in range(2):
            stream = http.client.HTTPConnection("127.0.0.1", gateway.port, timeout=20)
            stream.request("GET", BASE + "/cleared", headers={"Accept": "text/event-stream", **basic("root")})
            response = stream.getresponse()
            assert response.status == 200
            streams.append((stream, response))
        third = ask(gateway.port, "GET", BASE + "/p_double", headers=basic("vera"))
        assert third.status == 429 and "device" in third.json["detail"]
        for stream, response in streams:
            response.close()
            stream.close()
        deadline = time.monotonic() + 10
        while ask(gateway.port, "GET", BASE + "/p_double", headers=basic("vera")).status == 429:
            assert time.monotonic() < deadline
            time.sleep(0.3)


SESSION_CLIENT = """
import sys
import RobotRaconteur as RR
with RR.ClientNodeSetup():
    root = RR.RobotRaconteurNode.s.ConnectService(sys.argv[1])
    wire = root.both.Connect()
    outcomes = []
    for _ in range(int(sys.argv[2])):
        wire.OutValue = 1.0
        try:
            outcomes.append(type(root.p_double).__name__)
        except RR.RobotRaconteurException as error:
            outcomes.append(type(error).__name__ + ": " + str(error))
    print("\\n".join(outcomes))
"""


def test_rates_of_requests_in_a_shared_session(device, tmp_path):
    devices = [{"name": "interop", "url": device, "mode": "shared"}]
    with running(tmp_path, device, {}, devices=devices, rates={"client": {"per_second": 5}}) as gateway:
        url = f"rr+tcp://127.0.0.1:{gateway.port}/?nodename=interop&service=interop"
        done = subprocess.run([sys.executable, "-c", SESSION_CLIENT, url, "60"], capture_output=True, text=True, timeout=60)
        outcomes = done.stdout.splitlines()
        assert len(outcomes) == 60 and outcomes[0] == "float", done
        refused = {each for each in outcomes if each != "float"}
        (why,) = refused
        assert why.startswith("OutOfSystemResourceException") and "asked for more than 5 requests a second from 127.0.0.1" in why
        time.sleep(1)  # or the next look would be one too many
        metrics = ask(gateway.port, "GET", "/metrics").body.decode()
        count = next(float(line.split()[1]) for line in metrics.splitlines()
                     if line.startswith("rrgate_rejected_total") and 'reason="rate"' in line)
        assert count >= len([each for each in outcomes if each != "float"])


def test_rates_of_requests_over_json_on_a_websocket(own_service, tmp_path):
    make_users(tmp_path)
    service, device = own_service
    rates = {"user": {"per_second": 5}, "device": {"at_once": 2}}
    with running(tmp_path, device, {"users_file": "users"}, rates=rates) as gateway:
        def answers(user, requests, is_stopped=False):
            with json_socket(gateway.port, basic(user)) as link:
                if is_stopped:  # so that none is answered before the last one is there
                    service.pause()
                for number, request in enumerate(requests):
                    link.send(json.dumps({"id": number, **request}))
                found = {}
                while len(found) < len(requests):
                    answer = json.loads(link.recv(20))
                    if is_stopped and "error" in answer:
                        service.resume()
                    if "id" in answer:
                        found[answer["id"]] = answer
                return list(found.values())

        def is_refused(answer, of):
            error = answer.get("error")
            return error is not None and error["name"] == "RobotRaconteur.OutOfSystemResource" and \
                error["retry_after"] == 1 and "asked for more than" in error["message"] and of in error["message"]

        # One after the other, so that never two are on their way.
        with json_socket(gateway.port, basic("alice")) as link:
            found = []
            for number in range(40):
                link.send(json.dumps({"id": number, "op": "get", "path": "p_double"}))
                found.append(json.loads(link.recv(20)))
        assert "result" in found[0]
        refused = [answer for answer in found if "error" in answer]
        assert refused and all(is_refused(answer, "5 requests a second of") for answer in refused), refused
        # Many at once: some are too many, and none is left without an answer.
        found = answers("root", [{"op": "get", "path": "p_double"}] * 4, is_stopped=True)
        assert any("result" in answer for answer in found) and any(is_refused(answer, "2 at once to device") for answer in found), found
        # What is sent on a wire is no request.
        found = answers("vera", [{"op": "send", "path": "both", "value": 1.0}] * 40)
        assert all("result" in answer for answer in found), found
        # What there is not is asked for no more often than anything else.
        found = answers("vera", [{"op": "fly"}] * 40)
        assert any(is_refused(answer, "") for answer in found), found
        assert all(is_refused(answer, "") or answer["error"]["name"] == "RobotRaconteur.InvalidArgument" for answer in found), found
