"""Recordings of the gateway, as agents read them. The agent is the official Python SDK."""
import json

import pytest
from mcp import MCPError

from agents import records, with_agent, with_tokens
from http_api import ask
from recordings import API, begin, begin_gateway, create, wait_for  # noqa: F401 (fixtures)

RECORDS = {"roles": ["agent"], "devices": ["create"], "may": ["record"], "agent": {}}
SCHEME = "rrgate-recording://"


@pytest.fixture
def begin_for_agents(begin_gateway, create, tmp_path):
    """A gateway; what the agent shows, and a person who records."""

    def start(*rules):
        config, agent, admin = with_tokens(tmp_path, {"roles": ["admin"], "may": ["record"]}, *rules)
        del config["is_up"]
        return begin_gateway(create, **config), agent, admin

    return start


def record(gateway, admin, least=60):
    """One that has ended."""
    recording = begin(gateway, headers=admin, members=["state", "DistanceTraveled"], interval_ms=50)
    url = f"{API}/{recording['name']}"
    seen = lambda: ask(gateway.port, "GET", url, headers=admin).json
    wait_for(seen, lambda now: (now["messages"] or 0) > least)
    return ask(gateway.port, "POST", url + "/stop", headers=admin).json


def read(gateway, agent, *uris, modern=False):
    async def work(session):
        return [json.loads((await session.read_resource(uri)).contents[0].text) for uri in uris]

    return with_agent(gateway.port, work, agent, modern)


def refusal(gateway, agent, uri):
    async def work(session):
        with pytest.raises(MCPError) as refused:
            await session.read_resource(uri)
        return str(refused.value)

    return with_agent(gateway.port, work, agent)


def uris(gateway, agent):
    async def work(session):
        return [str(each.uri) for each in (await session.list_resources()).resources]

    return with_agent(gateway.port, work, agent)


@pytest.mark.parametrize("modern", [False, True])
def test_an_agent_reads_what_a_recording_holds(begin_for_agents, modern):
    gateway, agent, admin = begin_for_agents(RECORDS)
    ended = record(gateway, admin)
    uri = SCHEME + ended["name"]
    assert uris(gateway, agent) == ["rrgate://create", uri]
    about, state, distance = read(gateway, agent, uri, uri + "/Create/state", uri + "/Create/DistanceTraveled", modern=modern)
    assert (about["device"], about["service"], about["state"], about["files_left_out"]) == ("create", "Create", "ended", 0)
    members = {each["path"]: each for each in about["from_device"]["members"]}
    assert members.keys() == {"Create/state", "Create/DistanceTraveled"}
    assert (members["Create/state"]["kind"], members["Create/DistanceTraveled"]["kind"]) == ("wire", "property")
    assert sum(each["count"] for each in members.values()) == ended["messages"]
    assert state["count"] == members["Create/state"]["count"] > 10 and state["per_second"] > 1
    assert state["first_time"] < state["last_time"]
    said = state["from_device"]
    for name in ("x", "heading"):
        numbers = said["numbers"][name]
        assert numbers["min"] <= said["first"][name] <= numbers["max"] and numbers["min"] <= numbers["mean"] <= numbers["max"]
    assert distance["from_device"]["numbers"].keys() == {""}
    done = wait_for(lambda: records(gateway.file.parent, "recording_read"), lambda read: len(read) == 3)  # written after the answer
    assert {each["outcome"] for each in done} == {"ok"}


def test_one_that_is_under_way_is_read_as_far_as_it_is_written(begin_for_agents):
    gateway, agent, admin = begin_for_agents(RECORDS)
    recording = begin(gateway, headers=admin, members=["state"])
    uri = SCHEME + recording["name"]
    counts = lambda: [each["count"] for each in read(gateway, agent, uri)[0]["from_device"]["members"]]
    wait_for(counts, lambda now: now and now[0] > 10)
    assert read(gateway, agent, uri)[0]["state"] == "recording"


def test_what_can_not_be_read_is_said(begin_for_agents):
    gateway, agent, admin = begin_for_agents(RECORDS)
    ended = record(gateway, admin, 10)
    uri = SCHEME + ended["name"]
    assert "nothing is recorded of 'Create/Drive'" in refusal(gateway, agent, uri + "/Create/Drive")
    assert "no recording" in refusal(gateway, agent, SCHEME + "create.Create.20200101T000000000Z")
    file = gateway.file.parent / "recordings" / ended["files"][0]["name"]
    file.write_bytes(b"not a recording")
    told = refusal(gateway, agent, uri)
    assert file.name in told and str(file.parent) not in told
    with file.open("wb") as out:
        out.truncate(40_000_000)
    assert "40000000 bytes" in refusal(gateway, agent, uri)


def test_only_the_newest_files_of_a_long_one_are_read(begin_for_agents):
    gateway, agent, admin = begin_for_agents(RECORDS)
    ended = record(gateway, admin, 10)
    folder = gateway.file.parent / "recordings"
    [first] = ended["files"]
    (folder / first["name"].replace(".mcap", "-2.mcap")).write_bytes((folder / first["name"]).read_bytes())
    with (folder / first["name"]).open("r+b") as out:
        out.truncate(40_000_000)
    [about] = read(gateway, agent, SCHEME + ended["name"])
    assert about["files_left_out"] == 1 and about["from_device"]["members"]


@pytest.mark.parametrize("rules", [[], [{**RECORDS, "devices": ["other"]}]], ids=["without", "of another device"])
def test_an_agent_without_the_right_knows_of_none(begin_for_agents, rules):
    gateway, agent, admin = begin_for_agents(*rules)
    ended = record(gateway, admin, 10)
    assert uris(gateway, agent) == ["rrgate://create"]
    there, not_there = (refusal(gateway, agent, SCHEME + name) for name in (ended["name"], "create.Create.20200101T000000000Z"))
    assert "may not record" in there and there == not_there


def test_the_right_of_agents_to_read_recordings_lets_them_make_none(begin_for_agents):
    gateway, agent, _ = begin_for_agents(RECORDS)
    begin(gateway, 403, agent)
    assert ask(gateway.port, "GET", API, headers=agent).json["recordings"] == []
