"""What agents are told of without asking again, by the official Python SDK: changes of values, of devices, and of what there is."""
import asyncio
import contextlib
import http.client
import json
import threading
import time

import pytest
from mcp import MCPError, types
from mcp.client.subscriptions import ResourcesListChanged, ResourceUpdated, SubscriptionLost, listen

from agents import lose_role, next_event, records, serving, with_agent, with_lines, with_tokens
from http_api import ask
from processes import start_gateway
from shared_sites import port_of
from tap import Tap

DEFINITION = """service experimental.lamp
stdver 0.10
object Lamp
    property double level
    property double secret
    wire double measured [readonly]
    event burnt()
end
"""
LEVEL, MEASURED = "rrgate://interop/robot/level", "rrgate://interop/robot/measured"


class Lamp:
    level = secret = 0.0


@contextlib.contextmanager
def shining():
    lamp = Lamp()
    with serving(DEFINITION, "experimental.lamp.Lamp", lamp) as url:
        yield url, lamp


@pytest.fixture
def site(tmp_path):
    """(the gateway's port, the lamp)"""
    with shining() as (url, lamp):
        gateway, port = start_gateway(tmp_path, url, device={"mode": "shared"}, mcp={})
        yield port, lamp
        gateway.stop()


async def silence(subscription, seconds):
    with pytest.raises(TimeoutError):
        await asyncio.wait_for(anext(subscription), seconds)


async def hear_of_values(session, lamp):
    """That which changes, and nothing else, and not oftener than once a second."""
    wanted = [LEVEL, MEASURED, "rrgate://interop/robot/burnt", "rrgate://interop/robot", "rrgate://nobody", "https://elsewhere.example"]
    async with listen(session, resource_subscriptions=wanted, tools_list_changed=True) as subscription:
        assert sorted(subscription.honored.resource_subscriptions) == [LEVEL, MEASURED]
        assert not subscription.honored.tools_list_changed
        await silence(subscription, 3)
        lamp.level = 0.5
        assert await next_event(subscription) == ResourceUpdated(LEVEL)
        read = await session.read_resource(LEVEL)
        assert json.loads(read.contents[0].text)["from_device"] == 0.5
        await silence(subscription, 3)
        over = threading.Event()

        def measure():
            for number in range(1000):
                lamp.measured.OutValue = float(number)
                if over.wait(0.01):
                    return

        measuring = threading.Thread(target=measure)
        measuring.start()
        begin = time.monotonic()
        heard = [await next_event(subscription) for _ in range(3)]
        took = time.monotonic() - begin
        over.set()
        measuring.join()
        assert heard == [ResourceUpdated(MEASURED)] * 3
        assert took > 1.5


def test_an_agent_hears_what_changes(site):
    port, lamp = site
    with_agent(port, lambda session: hear_of_values(session, lamp), modern=True)


def test_it_does_so_on_standard_input_and_output(site):
    port, lamp = site
    with_lines([f"http://127.0.0.1:{port}"], lambda session: hear_of_values(session, lamp), modern=True)


def test_an_agent_hears_that_a_device_is_lost_and_is_back(tmp_path):
    async def hear(session, lost, back):
        async with listen(session, resource_subscriptions=["rrgate://interop", MEASURED, LEVEL]) as subscription:
            lost()
            heard = {(await next_event(subscription)).uri}
            while len(heard) < 3:
                heard.add((await next_event(subscription)).uri)
            while "offline" not in (await session.read_resource("rrgate://interop")).contents[0].text:
                await next_event(subscription)
            back()
            while "online" not in (await session.read_resource("rrgate://interop")).contents[0].text:
                await next_event(subscription)

    with contextlib.ExitStack() as first, contextlib.ExitStack() as second:
        url, _ = first.enter_context(shining())
        line = Tap(port_of(url))
        second.callback(line.close)
        gateway, port = start_gateway(tmp_path, url.replace(f":{port_of(url)}/", f":{line.port}/"), device={"mode": "shared"}, mcp={}, retry={"min_ms": 50, "max_ms": 200})
        second.callback(gateway.stop)

        def back():
            line.lead_to(port_of(second.enter_context(shining())[0]))

        with_agent(port, lambda session: hear(session, first.close, back), modern=True)


def test_who_loses_a_right_hears_no_more_and_others_hear_that_the_list_is_another(tmp_path):
    config, agent, _ = with_tokens(tmp_path)

    async def hear(session):
        async with listen(session, resources_list_changed=True) as of_list:
            assert of_list.honored.resources_list_changed
            async with listen(session, resource_subscriptions=[MEASURED]) as of_value:
                assert of_value.honored.resource_subscriptions == [MEASURED]
                await silence(of_list, 2)
                begin = time.monotonic()
                lose_role(tmp_path)
                assert await next_event(of_list) == ResourcesListChanged()
                with pytest.raises(SubscriptionLost) as lost:
                    await next_event(of_value)
                assert "may not subscribe" in str(lost.value.__cause__)
                return time.monotonic() - begin

    with shining() as (url, _):
        gateway, port = start_gateway(tmp_path, url, device={"mode": "shared"}, **config)
        took = with_agent(port, hear, agent, modern=True)
        assert took < 10
        assert [each["member"] for each in records(tmp_path, "subscribe")] == ["measured"]
        gateway.stop()


def test_after_a_cut_an_agent_asks_anew(site):
    port, lamp = site
    line = Tap(port)

    async def hear(session):
        async with listen(session, resource_subscriptions=[LEVEL]) as subscription:
            line.cut()
            with pytest.raises(SubscriptionLost):
                await next_event(subscription)
        async with listen(session, resource_subscriptions=[LEVEL]) as subscription:
            await silence(subscription, 3)
            lamp.level = 2.0
            assert await next_event(subscription) == ResourceUpdated(LEVEL)

    with_agent(line.port, hear, modern=True)
    line.close()


def test_what_is_no_filter_is_refused_and_older_revisions_have_none(site):
    port = site[0]
    modern = {"MCP-Protocol-Version": "2026-07-28", "Mcp-Method": "subscriptions/listen"}
    meta = {"io.modelcontextprotocol/protocolVersion": "2026-07-28"}

    def refused(params, headers=modern):
        message = {"jsonrpc": "2.0", "id": 1, "method": "subscriptions/listen", "params": {"_meta": meta, **params} if headers else params}
        return ask(port, "POST", "/mcp", message, headers or {}).json["error"]

    assert "notifications" in refused({})["message"]
    assert "at most 64" in refused({"notifications": {"resourceSubscriptions": ["rrgate://interop"] * 65}})["message"]
    assert "no string" in refused({"notifications": {"resourceSubscriptions": [7]}})["message"]
    assert "neither true nor false" in refused({"notifications": {"resourcesListChanged": 1}})["message"]
    assert refused({"notifications": {}}, None)["code"] == -32601


def test_an_older_revision_subscribes_for_its_session(site):
    port, lamp = site
    line = Tap(port)
    told = asyncio.Queue()

    async def note(message):
        if isinstance(message, types.ResourceUpdatedNotification):
            await told.put(str(message.params.uri))

    async def hear(session):
        with pytest.raises(MCPError, match="no member"):
            await session.subscribe_resource("rrgate://interop/robot/nothing")
        await session.subscribe_resource(LEVEL)
        lamp.level = 3.0
        assert await asyncio.wait_for(told.get(), 15) == LEVEL
        line.cut()
        assert await asyncio.wait_for(told.get(), 15) == LEVEL
        await session.unsubscribe_resource(LEVEL)
        lamp.level = 4.0
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(told.get(), 4)

    with_agent(line.port, hear, message_handler=note)
    line.close()


def test_a_stream_is_of_a_session_which_ends_with_its_delete(site):
    port = site[0]
    initialize = {"jsonrpc": "2.0", "id": 1, "method": "initialize", "params": {"protocolVersion": "2025-11-25"}}
    session = {"Mcp-Session-Id": ask(port, "POST", "/mcp", initialize).headers["Mcp-Session-Id"], "MCP-Protocol-Version": "2025-11-25"}
    assert ask(port, "GET", "/mcp").status == 405
    assert ask(port, "GET", "/mcp", headers={**session, "MCP-Protocol-Version": "2026-07-28"}).status == 405
    assert ask(port, "GET", "/mcp", headers={**session, "Last-Event-ID": "1"}).status == 404
    subscribe = {"jsonrpc": "2.0", "id": 2, "method": "resources/subscribe", "params": {"uri": LEVEL}}
    assert "Mcp-Session-Id" in ask(port, "POST", "/mcp", subscribe).json["error"]["message"]
    assert ask(port, "POST", "/mcp", subscribe, session).json["result"] == {}

    def stream(**more):
        connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
        connection.request("GET", "/mcp", headers={**session, "Accept": "text/event-stream", **more})
        response = connection.getresponse()
        assert response.status == 200
        assert response.readline().startswith(b"id: ")
        return response

    again = stream(**{"Last-Event-ID": "1"})
    lines = iter(again.readline, b"")
    assert any(b"notifications/resources/list_changed" in line for line in lines)  # since a cut: nobody knows
    first = stream()
    second = stream()  # a session has one
    assert first.read().startswith(b"data:")
    assert ask(port, "DELETE", "/mcp", headers=session).status == 204
    assert second.read().startswith(b"data:")
    assert ask(port, "GET", "/mcp", headers={**session, "Last-Event-ID": "1"}).status == 404
