// Recordings of strangers (MCAP files): each is read as it says what it holds, or refused with its path and the reason.
#include <cstdio>
#include <cstdlib>

#include "server/record/recording.hpp"
#include "test/fuzz/memory_bound.hpp"
#include "test/fuzz/memory_file.hpp"

namespace {

using namespace rrgate;

void require(bool holds, const char* rule, const std::string& detail = "") {
  if (holds) return;
  std::fprintf(stderr, "broken: %s: %s\n", rule, detail.c_str());
  std::abort();
}

void check_error(const rr::Error& error, const std::string& path) {
  require(error.message.starts_with(path + ": "), "an error names its file", error.message);
}

void read_messages(Recording& recording) {
  std::uint64_t count = 0;
  for (const auto& chunk : recording.chunks()) {
    const auto read = recording.read(chunk);
    require(read.has_value(), "what was there is there", read ? "" : read.error().message);
    require(read->messages.size() == chunk.message_count, "messages are counted");
    count += read->messages.size();
    for (const auto& message : read->messages) {
      require(message.log_time >= recording.begin() && message.log_time <= recording.end(), "a message has its time");
      const auto document = recording.read_document(message);
      if (!document) check_error(document.error(), recording.name());
    }
  }
  require(count == recording.message_count(), "messages are in chunks");
  count = 0;
  for (const auto& [channel, member] : recording.members()) {
    const auto told = recording.for_each(member, [&count](const McapMessage&) {
      ++count;
      return rr::Result<>();
    });
    require(told.has_value(), "messages of a member are told");
  }
  require(count == recording.message_count(), "each message is of one member");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const rr::fuzz::MemoryFile file({data, size});
  const rr::fuzz::MemoryBound bound(size, 4u << 20, 128);
  const auto path = file.path();
  static_cast<void>(recorded_ring(path));
  const bool may_have_messages = has_recorded_messages(path);
  auto recording = Recording::open(path);
  if (!recording) {
    check_error(recording.error(), path);
    return 0;
  }
  require(may_have_messages || recording->message_count() == 0, "a file without messages has none");
  require(!recording->services().empty(), "a recording is of a service");
  read_messages(*recording);
  return 0;
}
