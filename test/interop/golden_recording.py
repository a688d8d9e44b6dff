"""The recording that is kept, as the mcap package reads it, and values of the real package as it has them."""
import base64
import json

from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from processes import ROOT

FILE = ROOT / "test" / "golden" / "recordings" / "create.mcap"
DEADLINE = 20.0  # seconds


def read_messages():
    """[(kind, member, time stamp in ns, what the document holds)], as the mcap package reads them."""
    with open(FILE, "rb") as file:
        reader = make_reader(file, validate_crcs=True)
        [service] = [each for each in reader.iter_metadata() if each.name == "robotraconteur.service"]
        found = [(channel.metadata["kind"], channel.topic.rsplit("/", 1)[1], message.publish_time, json.loads(message.data))
                 for _, channel, message in reader.iter_messages(log_time_order=False)]
    assert service.metadata["type"] == "experimental.simulatedcreate.SimulatedCreate"
    return [(kind, member, stamp, document if kind == "event" else document["value"]) for kind, member, stamp, document in found]


MESSAGES = read_messages()


def write_later(path, seconds):
    """The same so much later, as the mcap package writes it: its channels have other numbers."""
    with open(FILE, "rb") as file, open(path, "wb") as out:
        reader, writer = make_reader(file), Writer(out, compression=CompressionType.NONE)
        writer.start()
        for each in reader.iter_metadata():
            writer.add_metadata(each.name, each.metadata)
        channels = {}
        for _, channel, message in reader.iter_messages(log_time_order=False):
            if channel.id not in channels:
                channels[channel.id] = writer.register_channel(channel.topic, channel.message_encoding, 0, channel.metadata)
            later = {"log_time": message.log_time + seconds * 10**9, "publish_time": message.publish_time + seconds * 10**9}
            writer.add_message(channels[channel.id], data=message.data, sequence=message.sequence, **later)
        writer.finish()


def plain(value):
    """A value of the real package as the recording has it."""
    if hasattr(value, "dtype"):
        return base64.b64encode(bytes(value)).decode() if value.dtype == "uint8" else value.tolist()
    if isinstance(value, list):
        return [plain(each) for each in value]
    if type(value).__module__.startswith("RobotRaconteur"):
        return {name: plain(getattr(value, name)) for name in dir(value) if not name.startswith(("_", "rr"))}
    return value
