// Info files of rr+local, which any program of this machine may have written.
#include <cstdlib>

#include "node/transport/local_files.hpp"
#include "test/fuzz/memory_bound.hpp"

namespace {

void require(bool claim) {
  if (!claim) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const rr::fuzz::MemoryBound bound(size);
  const auto info = rr::parse_local_info(rr::as_text(rr::ByteSpan(data, size)));
  if (!info) {
    require(info.error().message.size() < 500);
    return 0;
  }
  require(info->socket.front() == '/' && info->socket.find('\0') == std::string::npos);
  require(info->node.name.empty() || rr::is_valid_node_name(info->node.name));
  // What was accepted, written by us, says the same again.
  const auto text = rr::format_local_info(*info);
  const auto again = rr::parse_local_info(text);
  require(again.has_value() && rr::format_local_info(*again) == text);
  return 0;
}
