"""Locks, logins and callbacks of several clients that share the gateway's session with a device. Device and clients are
those of the real package."""
import threading

import pytest
import RobotRaconteur as RR

from json_sockets import Socket
from news import News
from shared_sites import Site, is_refused, start_service

GATEWAY_LOGIN = {"login": {"username": "gateway", "password": "secret"}}
USER_LOCK = RR.RobotRaconteurObjectLockFlags_USER_LOCK
CLIENT_LOCK = RR.RobotRaconteurObjectLockFlags_CLIENT_LOCK
LOCKED = RR.ObjectLockedException


@pytest.fixture
def site(node, tmp_path):
    made = Site(tmp_path, node, GATEWAY_LOGIN)
    yield made
    made.stop()


class Call:
    """A call that goes on in a thread of its own."""

    def __init__(self, call):
        self._outcome = None
        self._thread = threading.Thread(target=self._run, args=(call,), daemon=True)
        self._thread.start()

    def _run(self, call):
        try:
            self._outcome = (call(), None)
        except Exception as error:
            self._outcome = (None, error)

    def result(self):
        self._thread.join(20)
        assert self._outcome, "the call has not ended"
        value, error = self._outcome
        if error:
            raise error
        return value


@pytest.fixture
def site_with_monitors(node, tmp_path):
    """Its device is ours: those of the real package in Python have none."""
    made = Site(tmp_path, node, start_device=start_service)
    yield made
    made.stop()


# --- callbacks ---


def test_a_callback_that_may_be_for_several_clients_is_for_none(site):
    """Each of them is in a call of the same object: the gateway can't know whose call the device asks about."""
    first, second = site.connect("plain"), site.connect("plain")
    asked = News()

    def confirm(number):
        def answer(question):
            asked.add((number, question))
            return f"from {number}"
        return answer
    first.confirm.Function, second.confirm.Function = confirm(1), confirm(2)
    assert second.ask("are you there?") == "from 2"
    moving = Call(lambda: first.move(1.0))
    site.gateway.wait_until(lambda: first.moving == 1)
    with pytest.raises(RR.InvalidOperationException, match="none of them is meant"):
        second.ask("may it move?")
    second.finish()
    assert moving.result() == 1.0
    assert second.ask("may it move now?") == "from 2"
    assert asked.all() == [(2, "are you there?"), (2, "may it move now?")]



def test_a_callback_is_not_for_a_client_that_calls_another_object(site):
    holder, second = site.connect("plain"), site.connect("plain")
    asked = News()

    def confirm(question):
        asked.add(question)
        return "yes"
    holder.confirm.Function = confirm
    tool = holder.get_tool()
    holding = Call(tool.hold)
    site.gateway.wait_until(lambda: second.moving == 1)
    second.ask_later("may it?")
    site.gateway.wait_until(lambda: second.answered != "")
    # Refused by the gateway, or, while its own call goes on, by the second client, which has no function for it.
    assert second.answered in ("RobotRaconteur.InvalidOperation", "RobotRaconteur.OperationFailed")
    assert asked.all() == []
    second.finish()
    holding.result()


# --- logins of the gateway ---


def test_the_gateways_login_is_for_the_services_that_want_one(site):
    whose = {"guarded": "gateway", "open": "gateway", "plain": ""}
    assert {service: site.connect(service).who() for service in whose} == whose


def test_a_restart_of_the_device_changes_nothing_of_who_is_who(site):
    """Neither for the gateway's login, nor for a page's, nor for callbacks: a call that was lost with the device is no
    reason to ask its client."""
    whose = {"guarded": "gateway", "open": "gateway", "plain": ""}
    roots = {service: site.connect(service) for service in whose}
    second = site.connect("plain")
    with Socket(site.port, "/api/v1/devices/interop/guarded") as page:
        page.ask("login", username="alice", password="secret")
        assert page.refusal("login", username="bob", password="wrong")[0] == "AuthenticationError"
        moving = Call(lambda: roots["plain"].move(1.0))
        site.gateway.wait_until(lambda: second.moving == 1)
        site.restart_device(second)
        with pytest.raises(RR.ConnectionException, match="connection_lost"):
            moving.result()
        for service, root in roots.items():
            site.wait_until_served(root)
            assert root.who() == whose[service]
        site.gateway.wait_until(lambda: "result" in page.next(id=page.send("get", "status")))
        assert page.ask("call", "who", args={}) == "alice"
    roots["plain"].confirm.Function = lambda question: "from the first"
    second.confirm.Function = lambda question: "from the second"
    assert second.ask("are you there?") == "from the second"


def test_a_client_too_many_hears_so_from_a_device_that_came_back_too(node, tmp_path):
    site = Site(tmp_path, node, {"max_clients": 1})
    try:
        root = site.connect("plain")
        for _ in range(2):
            with pytest.raises(RR.ConnectionException, match="all the clients it may have"):
                site.connect("plain")
            site.restart_device(root)
        assert root.status == 0
    finally:
        site.stop()


# --- locks ---


@pytest.mark.parametrize("flags", [USER_LOCK, CLIENT_LOCK])
def test_a_lock_keeps_out_everybody_but_its_holder(site, flags):
    """Whichever way they come: to the device, holder and others of the gateway are one user."""
    holder, other = site.connect(), site.connect()
    direct = site.direct("guarded", "bob")
    late = other.target.Connect()  # connected before: packets go on, as with a device of one's own
    site.node.RequestObjectLock(holder, flags)
    holder.speed = 1.0
    for root in (other, direct):
        with pytest.raises(LOCKED):
            root.speed = 2.0
        with pytest.raises(LOCKED):
            root.who()
        with pytest.raises(LOCKED):
            root.get_tool().opening
        with pytest.raises(LOCKED):
            root.state.Connect()
        assert root.shown == 0.0  # nolockread
        root.status = 0  # nolock
        with pytest.raises(LOCKED):
            site.node.RequestObjectLock(root, flags)
        with pytest.raises(LOCKED):
            site.node.ReleaseObjectLock(root)
    late.Close()
    assert holder.speed == 1.0
    site.node.ReleaseObjectLock(holder)
    for number, root in enumerate((holder, other, direct)):
        root.speed = float(number)
        assert root.speed == number


def test_a_lock_of_an_object_leaves_the_others(site):
    holder, other = site.connect(), site.connect()
    first, second = holder.get_tools(0), other.get_tools(1)
    site.node.RequestObjectLock(first, CLIENT_LOCK)
    first.opening = 1.0
    second.opening = 2.0
    other.speed = 3.0
    with pytest.raises(LOCKED):
        other.get_tools(0).opening = 4.0
    with pytest.raises(LOCKED):
        site.node.RequestObjectLock(other, CLIENT_LOCK)
    site.leave(holder)  # with its lock
    site.gateway.wait_until(lambda: not is_refused(LOCKED, lambda: site.node.RequestObjectLock(other, CLIENT_LOCK)))
    other.get_tools(0).opening = 5.0


def test_a_holder_keeps_its_wires_and_its_calls(site):
    holder, other = site.connect(), site.connect()
    site.node.RequestObjectLock(holder, USER_LOCK)
    target = holder.target.Connect()
    state = News()
    connection = holder.state.Connect()
    connection.WireValueChanged += lambda wire, value, time: state.add(value)
    moving = Call(lambda: holder.move(7.0))
    site.gateway.wait_until(lambda: other.moving == 1)
    target.OutValue = 3.0
    site.gateway.wait_until(lambda: holder.seen_target == 3.0)
    site.node.ReleaseObjectLock(holder)
    target.OutValue = 4.0
    site.gateway.wait_until(lambda: holder.seen_target == 4.0)
    holder.finish()
    assert moving.result() == 7.0


def test_a_holder_hears_that_its_lock_went_with_the_device(site):
    holder, other = site.connect(), site.connect()
    site.node.RequestObjectLock(holder, USER_LOCK)
    holder.speed = 1.0
    site.restart_device(other)
    # The device knows of no lock any more: nobody has one, and who believes so is not let in.
    with pytest.raises(LOCKED, match="lost"):
        holder.speed = 2.0
    with pytest.raises(LOCKED, match="lost"):
        holder.target.Connect()
    other.speed = 3.0
    site.node.RequestObjectLock(other, CLIENT_LOCK)
    with pytest.raises(LOCKED):
        site.node.RequestObjectLock(holder, USER_LOCK)
    with pytest.raises(LOCKED):
        holder.speed = 4.0
    site.node.ReleaseObjectLock(other)
    site.node.RequestObjectLock(holder, USER_LOCK)
    holder.speed = 5.0
    with pytest.raises(LOCKED):
        other.speed = 6.0
    assert holder.speed == 5.0


def test_a_holder_who_unlocks_what_it_has_lost_goes_on(site):
    holder, other = site.connect(), site.connect()
    site.node.RequestObjectLock(holder, CLIENT_LOCK)
    site.restart_device(other)
    site.node.ReleaseObjectLock(holder)
    holder.speed = 1.0
    other.speed = 2.0
    assert holder.speed == other.speed == 2.0


def test_a_user_of_the_device_hears_that_his_lock_went_with_it(site):
    """He has a session of his own with the device."""
    alice, again, other = site.connect("guarded", "alice"), site.connect("guarded", "alice"), site.connect()
    site.node.RequestObjectLock(alice, USER_LOCK)
    alice.speed = 1.0
    again.speed = 2.0
    with pytest.raises(LOCKED):
        other.speed = 3.0
    site.restart_device(other)
    for root in (alice, again):
        site.wait_until_served(root)
        with pytest.raises(LOCKED, match="lost"):
            root.speed = 4.0
    other.speed = 5.0
    site.node.RequestObjectLock(again, USER_LOCK)
    alice.speed = 6.0
    with pytest.raises(LOCKED):
        other.speed = 7.0


def test_a_lock_that_the_device_keeps_for_a_lost_session(site):
    """The line was cut, and the device is there still: it keeps everybody out until the holder unlocks."""
    holder, other = site.connect(), site.connect()
    site.node.RequestObjectLock(holder, USER_LOCK)
    site.line.cut()
    site.wait_until_served(other)
    with pytest.raises(LOCKED, match="lost"):
        holder.speed = 1.0
    with pytest.raises(LOCKED):
        other.speed = 2.0
    site.node.ReleaseObjectLock(other)  # it is not his
    with pytest.raises(LOCKED):
        other.speed = 3.0
    site.node.ReleaseObjectLock(holder)
    other.speed = 4.0
    holder.speed = 5.0
    site.node.RequestObjectLock(holder, USER_LOCK)
    with pytest.raises(LOCKED):
        other.speed = 6.0


def test_a_device_is_made_safe_once_a_lock_that_it_keeps_for_a_lost_session_is_given_back(node, tmp_path):
    leases = {"safe": [{"property": "guarded.speed", "value": 0}]}
    site = Site(tmp_path, node, {**GATEWAY_LOGIN, "leases": leases})
    try:
        with Socket(site.port, "/api/v1/devices/interop/guarded") as page:
            page.ask("lock", kind="client")
            page.ask("lease", deadman=60000)
            page.ask("set", "speed", value=2)
            arm, other = site.direct("guarded", "alice"), site.connect()
            site.line.cut()
            page.next(lease="guarded", state="ended")
            site.wait_until_served(other)
            assert is_refused(LOCKED, lambda: arm.speed)
            page.ask("unlock")
            site.gateway.wait_until(lambda: not is_refused(LOCKED, lambda: arm.speed) and arm.speed == 0)
    finally:
        site.stop()


def test_a_lock_of_a_page_keeps_out_everybody(site):
    other = site.connect()
    with Socket(site.port, "/api/v1/devices/interop/guarded") as page, Socket(site.port, "/api/v1/devices/interop/guarded") as second:
        page.ask("lock", kind="user")
        page.ask("set", "speed", value=1)
        with pytest.raises(LOCKED):
            other.speed = 2.0
        assert second.refusal("set", "speed", value=3)[0] == "ObjectLockedError"
        assert page.ask("get", "speed") == 1
    site.gateway.wait_until(lambda: not is_refused(LOCKED, lambda: other.speed))
    other.speed = 4.0


def test_a_monitor_that_went_with_the_device(site_with_monitors):
    site = site_with_monitors
    owner, other = site.connect("open"), site.connect("open")
    site.node.MonitorEnter(owner, -1)
    owner.level = 2.0
    with pytest.raises(RR.InvalidOperationException):
        other.level = 3.0
    site.device.stop()
    with pytest.raises(RR.ConnectionException, match="connection_lost"):
        while True:
            owner.level
    site.start_again()
    site.gateway.wait_until(lambda: not is_refused(RR.ConnectionException, lambda: other.level))
    with pytest.raises(RR.InvalidOperationException, match="lost"):
        owner.level = 4.0
    site.node.MonitorEnter(other, 1000)
    other.level = 5.0
    site.node.MonitorExit(owner)
    with pytest.raises(RR.InvalidOperationException, match="currently monitor locked"):
        owner.level = 6.0
    site.node.MonitorExit(other)
    owner.level = 7.0
    assert other.level == 7.0
