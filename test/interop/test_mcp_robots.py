"""Robots of the field as an agent meets them: an educational robot and one of the standard types, both drivers from PyPI. The agent is
the official Python SDK."""
import json

import pytest
from mcp.client.subscriptions import ResourceUpdated, listen

from agents import next_event, records, with_agent, with_tokens
from processes import start_gateway

FREELY = {"approval": "none", "lease": False}
MOVES = [{"roles": ["agent"], "members": ["teleport"], "may": ["call"],
          "agent": {**FREELY, "limits": {"x": [-0.5, 0.5], "y": [-0.25, 0.25]}}},
         {"roles": ["agent"], "members": ["color"], "may": ["write"], "agent": FREELY}]


@pytest.fixture
def meet(tmp_path):
    """What `work` does with a session of an agent at a robot."""
    gateways = []

    def begin(url, work, *rules, modern=True):
        config, agent, _ = with_tokens(tmp_path, *rules)
        gateway, port = start_gateway(tmp_path, url, device={"mode": "shared"}, **config)
        gateways.append(gateway)
        return with_agent(port, work, agent, modern)

    yield begin
    for gateway in gateways:
        gateway.stop()


async def use(session, tool, path, **arguments):
    result = await session.call_tool(tool, {"device": "interop", "path": path, **arguments})
    assert not result.is_error, result.content
    return result.structured_content


async def members_of(session, path):
    found, cursor = {}, None
    while True:
        page = await use(session, "describe", path, **({"cursor": cursor} if cursor else {}))
        found |= {each["name"]: each for each in page["members"]}
        cursor = page.get("nextCursor")
        if not cursor:
            return found


@pytest.mark.parametrize("modern", [False, True])
def test_reynard_is_found_watched_and_moved_within_limits(reynard, meet, modern, tmp_path):
    async def work(session):
        listed = await session.call_tool("devices", {})
        assert [each["path"] for each in listed.structured_content["devices"][0]["from_device"]["services"]] == ["reynard"]
        members = await members_of(session, "reynard")
        assert members["teleport"]["parameters"]["required"] == ["x", "y"]
        assert members["teleport"]["terms"]["limits"] == {"x": [-0.5, 0.5], "y": [-0.25, 0.25]}
        await use(session, "call", "reynard/teleport", args={"x": 0.25, "y": -0.125}, why="to stand there")
        assert (await use(session, "read", "reynard/robot_position"))["from_device"] == [0.25, -0.125]
        far = await session.call_tool("call", {"device": "interop", "path": "reynard/teleport", "args": {"x": 0.75, "y": 0}, "why": "x"})
        assert far.is_error and "OutOfRange" in far.structured_content["error"]["name"]
        assert (await use(session, "watch", "reynard/state", seconds=1))["count"] > 2
        if not modern:
            return
        color = "rrgate://interop/reynard/color"
        async with listen(session, resource_subscriptions=[color]) as subscription:
            await use(session, "set", "reynard/color", value=[0.25, 0.75, 0.5], why="to be seen")
            assert await next_event(subscription) == ResourceUpdated(color)
            told = json.loads((await session.read_resource(color)).contents[0].text)
            assert told["from_device"] == [0.25, 0.75, 0.5]

    meet(reynard, work, *MOVES, modern=modern)
    assert [each["outcome"] for each in records(tmp_path, "call")] == ["ok"]


def test_a_robot_of_the_standard_types_is_read_and_moves_only_by_a_rule(standard_robot, meet):
    async def work(session):
        members = await members_of(session, "robot")
        assert members["robot_state"]["kind"] == "wire" and members["jog_freespace"]["may"] == []
        info = (await use(session, "read", "robot/robot_info"))["from_device"]
        assert info["device_info"]["device"]["name"] == "test_robot" and len(info["joint_info"]) == 2
        watched = await use(session, "watch", "robot/robot_state", seconds=1)
        assert watched["count"] > 5 and "joint_position.0" in watched["from_device"]["numbers"]
        refused = await session.call_tool("call", {"device": "interop", "path": "robot/disable", "args": {}, "why": "to see"})
        assert refused.is_error and "no rule with \"agent\" gives it" in refused.structured_content["error"]["message"]

    meet(standard_robot, work)
