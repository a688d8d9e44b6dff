// Files of the audit log, whatever is in them: all that read them give an answer, and what was changed is found. The
// first byte chooses a file as it is ('f'), or records of what strangers have said ('r').
#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "server/access/audit_tail.hpp"
#include "server/access/audit_trail.hpp"
#include "test/fuzz/memory_bound.hpp"
#include "test/fuzz/memory_file.hpp"

namespace {

using namespace rrgate;

const auto time_of_records = std::chrono::system_clock::time_point(std::chrono::seconds(1'900'000'000));

void require(bool holds, const char* rule) {
  if (holds) return;
  std::fprintf(stderr, "broken: %s\n", rule);
  std::abort();
}

AuditTail tail_of(const std::string& path, std::size_t limit) {
  AuditConfig config;
  config.file = path;
  config.keep = 0;
  auto tail = read_audit_tail(config, {}, limit);
  require(tail.has_value(), "what is there can be read");
  return std::move(*tail);
}

AuditTrail trail_of(const std::string& path) {
  auto trail = verify_audit_files({path});
  require(trail.has_value(), "what is there can be verified");
  return std::move(*trail);
}

void read_file(rr::ByteSpan bytes) {
  const rr::fuzz::MemoryFile file(bytes);
  const auto tail = tail_of(file.path(), 1000);
  require(tail.records.size() <= 1000, "so many records are read");
  for (const auto& record : tail.records) {
    require(record.find('\n') == std::string::npos, "a record is a line");
    require(parse_audit_line(record).has_value(), "what is read is a record");
  }
  const auto trail = trail_of(file.path());
  require(tail.records.size() <= trail.records, "records are verified");
  for (const auto& each : trail.findings)
    require(each.found.size() < 1000 && each.expected.size() < 1000, "a finding is a sentence");
}

/// A record each line, a member of it each piece between tabs.
void write_records(std::string_view text) {
  AuditChain chain;
  std::string lines;
  std::size_t count = 0;
  std::size_t last = 0;  // where it begins
  for (std::size_t begin = 0; begin < text.size() && count < 20; ++count) {
    const auto end = std::min(text.find('\n', begin), text.size());
    const auto said = text.substr(begin, end - begin);
    begin = end + 1;
    const auto tab = std::min(said.find('\t'), said.size());
    const Identity who{.name = std::string(said.substr(0, tab)), .client = std::string(said)};
    const AccessRequest what{.device = said.substr(tab), .path = said};
    last = lines.size();
    lines += chain.add(
        format_audit_event({.event = "call", .who = &who, .what = &what, .detail = said}, time_of_records), count == 0);
  }
  if (count == 0) return;
  const rr::fuzz::MemoryFile file(rr::as_bytes(lines));
  const auto tail = tail_of(file.path(), 100);
  require(tail.records.size() == count && tail.is_all, "what is recorded is read");
  require(trail_of(file.path()).last == chain, "a chain is followed to its end");

  // One byte of the last record is another one.
  const auto at = last + text.size() % (lines.size() - last - 1);
  lines[at] = static_cast<char>(lines[at] ^ 1);
  const rr::fuzz::MemoryFile changed(rr::as_bytes(lines));
  const auto trail = trail_of(changed.path());
  require(trail.last != chain || trail.findings.size() > trail_of(file.path()).findings.size(),
          "what was changed is found");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const rr::fuzz::MemoryBound bound(size, 2u << 20, 512);
  if (size == 0) return 0;
  const auto rest = rr::ByteSpan(data, size).subspan(1);
  if (data[0] == 'r')
    write_records(rr::as_text(rest));
  else
    read_file(rest);
  return 0;
}
