"""Who guesses passwords has to wait, and nobody else."""
import itertools
import socket
import statistics
import time

from access_gateways import running
from gateways import rrgate
from http_api import BASE, ask
from news import under_load
from users import RULES, basic, make_users


def test_who_guesses_passwords_has_to_wait(device, tmp_path):
    """Of one user so many guesses in a row, of one address more, then one a second; the right password too. It keeps out
    neither others of that address nor the same user elsewhere."""
    make_users(tmp_path)
    with running(tmp_path, device, {"users_file": "users", "rules": RULES}) as gateway:
        def log_in(name, password=None, address="127.0.0.3"):
            answer = ask(gateway.port, "GET", BASE + "/p_double", headers=basic(name, password), address=address)
            return answer.status, answer.json["detail"] if answer.status != 200 else ""

        def guess(names):
            """Until that is stopped. Returns how often."""
            for guesses, name in enumerate(names):
                refused = log_in(name, f"guess {guesses}")
                if "too many logins have failed" in refused[1]:
                    return guesses
                assert refused == (401, "Invalid username or password")
            raise AssertionError("guessing goes on and on")

        assert 20 <= guess(["alice"] * 200) < 60
        assert log_in("root") == (200, "")
        assert log_in("alice", address="127.0.0.5") == (200, "")
        guess(f"user{number}" for number in range(200))
        assert log_in("vera", address="127.0.0.5") == (200, "")
        for name in ("vera 2", "vera 3"):
            rrgate("passwd", tmp_path / "users", name.replace(" ", ""), "--roles", "viewer", given="right\n")
        gateway.wait_for("users and rights read anew")
        for name in ("vera2", "vera3"):
            guess(f"user{number}" for number in range(200))
            if (answer := log_in(name, "right"))[0] != 200:  # unless the second is over just now
                break
        assert answer[0] == 401 and "too many logins have failed" in answer[1], "the right password had not to wait"
        deadline = time.monotonic() + 20
        while log_in(name, "right")[0] != 200:
            assert time.monotonic() < deadline
            time.sleep(0.1)


def test_a_right_password_gets_in_during_a_flood_of_wrong_ones(device, tmp_path):
    make_users(tmp_path)
    for number in range(3):
        rrgate("passwd", tmp_path / "users", f"user{number}", "--roles", "viewer", given="right\n")
    with running(tmp_path, device, {"users_file": "users", "rules": RULES}) as gateway:
        numbers, waits = itertools.count(), []

        def guess():
            number = next(numbers)
            name = f"user{number % 3}" if number % 2 else f"nobody{number}"
            began = time.monotonic()
            refused = ask(gateway.port, "GET", BASE + "/p_double", headers=basic(name, f"guess {number}"), address=f"127.0.1.{number % 30 + 1}")
            assert refused.status == 401
            waits.append(time.monotonic() - began)

        with under_load(guess, threads=30):
            took = []
            for number in range(3):
                began = time.monotonic()
                answer = ask(gateway.port, "GET", BASE + "/p_double", headers=basic(f"user{number}", "right"), address="127.0.2.1")
                assert answer.status == 200, answer.body
                took.append(time.monotonic() - began)
        # Each wrong one waits for some thirty others; a right one for those that have their turn.
        assert max(took) < statistics.median(waits) / 3, (took, waits)


def test_logins_that_a_device_has_not_judged_take_nobodys_place(device, own_service, tmp_path):
    service, stuck = own_service
    devices = [{"name": "interop", "url": device}, {"name": "stuck", "url": stuck, "max_clients": 1}]
    with running(tmp_path, device, {}, devices=devices) as gateway:
        gateway.wait_for("device online", device="stuck")
        service.pause()
        path = BASE.replace("devices/interop", "devices/stuck") + "/p_double"
        links = []
        try:
            for number in range(260):
                link = socket.create_connection(("127.0.0.1", gateway.port), 10, source_address=(f"127.0.1.{number % 13 + 1}", 0))
                proof = basic(f"user{number}", "guess")["Authorization"]
                link.sendall(f"GET {path} HTTP/1.1\r\nHost: localhost\r\nAuthorization: {proof}\r\n\r\n".encode())
                links.append(link)
            assert ask(gateway.port, "GET", BASE + "/p_double").status == 200
            assert read_clients(gateway.port)["stuck"] == 0
        finally:
            for link in links:
                link.close()
            service.resume()


def read_clients(port):
    return {each["name"]: each["clients"] for each in ask(port, "GET", "/api/v1/devices").json["devices"]}
