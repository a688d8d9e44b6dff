#include "server/access/audit_trail.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <map>
#include <utility>

namespace rrgate {

namespace {

rr::Error unreadable(const std::string& file) {
  return rr::make_error(rr::ErrorCode::io_error,
                        file + ": " + std::strerror(errno));  // NOLINT(concurrency-mt-unsafe): one thread
}

std::string name_of(std::uint64_t seq) {
  return "record " + std::to_string(seq);
}

/// Follows the chain from line to line; behind a finding it goes on with what is there.
class Follower {
 public:
  explicit Follower(AuditTrail& trail) : trail_(trail) {}

  void begin_file(const std::string& file) {
    file_ = &file;
    line_ = 0;
  }

  void take(const std::string& text) {
    ++line_;
    const auto line = parse_audit_line(text);
    if (!line) return take_other(text);
    if (trail_.records++ == 0)
      begin(*line);
    else
      follow(*line);
    trail_.last = {line->seq, line->hash};
  }

 private:
  void take_other(const std::string& text) {
    if (trail_.records == 0 && text.starts_with("{\"time\":")) {
      ++trail_.unchained;
      return;
    }
    find("no record: " + rr::quote(text, 80), trail_.records == 0 ? "a record" : name_of(trail_.last.seq + 1));
  }

  void begin(const AuditLine& line) {
    trail_.first = line.seq;
    const AuditChain start;
    if (trail_.unchained > 0 && line.seq != 1)
      find(name_of(line.seq) + " behind " + std::to_string(trail_.unchained) + " lines without a place in the chain",
           name_of(1));
    else if (!line.previous || (line.seq == 1 && *line.previous != start.hash))
      find(name_of(line.seq) + (line.previous ? " with something before it" : " without \"prev\""),
           line.seq == 1 ? "nothing before record 1" : "the first record of a file, which says the hash before it");
    else
      check_hash(*line.previous, line);
  }

  void follow(const AuditLine& line) {
    const auto& last = trail_.last;
    if (line.seq != last.seq + 1)
      find(name_of(line.seq), name_of(last.seq + 1));
    else if (line.previous && *line.previous != last.hash)
      find(name_of(line.seq) + " behind one with hash " + *line.previous, "hash " + last.hash);
    else
      check_hash(last.hash, line);
  }

  void check_hash(const std::string& previous, const AuditLine& line) {
    if (const auto hash = hash_audit_line(previous, line); hash != line.hash)
      find(name_of(line.seq) + " with hash " + line.hash, "hash " + hash + " by its text and the record before");
  }

  void find(std::string found, std::string expected) {
    trail_.findings.push_back({*file_, line_, std::move(found), std::move(expected)});
  }

  AuditTrail& trail_;
  const std::string* file_ = nullptr;
  std::uint64_t line_ = 0;
};

struct Head {
  std::string file;  ///< of the log
  AuditChain chain;
};

std::vector<Head> read_heads(const std::vector<std::string>& files) {
  std::vector<Head> out;
  for (const auto& file : files) {
    std::ifstream in(file + ".head");
    Head head{file, {}};
    if (in >> head.chain.seq >> head.chain.hash) out.push_back(std::move(head));
  }
  return out;
}

/// "audit.jsonl.1": its end is told by the file that came after it.
bool was_renamed(const std::string& file) {
  const auto dot = file.rfind('.');
  return dot != std::string::npos && dot + 1 < file.size() &&
         file.find_first_not_of("0123456789", dot + 1) == std::string::npos;
}

}  // namespace

rr::Result<std::vector<std::string>> sort_audit_files(std::vector<std::string> files) {
  std::multimap<std::uint64_t, std::string> sorted;
  std::erase_if(files, [](const std::string& file) { return file.ends_with(".head"); });  // as FILE* gives
  for (auto& file : files) {
    std::ifstream in(file);
    if (!in) return unreadable(file);
    std::uint64_t first = 0;
    for (std::string text; first == 0 && std::getline(in, text);)
      if (const auto line = parse_audit_line(text)) first = line->seq;
    if (in.bad()) return unreadable(file);
    sorted.emplace(first, std::move(file));
  }
  std::vector<std::string> out;
  for (auto& [first, file] : sorted) out.push_back(std::move(file));
  return out;
}

rr::Result<AuditTrail> verify_audit_files(const std::vector<std::string>& files) {
  const auto heads = read_heads(files);  // before the files, which may be written to meanwhile
  const auto sorted = sort_audit_files(files);
  if (!sorted) return sorted.error();
  AuditTrail trail;
  Follower follower(trail);
  std::vector<std::string> hashes(heads.size());  // of the records that the heads name
  for (const auto& file : *sorted) {
    std::ifstream in(file);
    if (!in) return unreadable(file);
    follower.begin_file(file);
    for (std::string text; std::getline(in, text);) {
      follower.take(text);
      for (std::size_t i = 0; i < heads.size(); ++i)
        if (heads[i].chain.seq == trail.last.seq) hashes[i] = trail.last.hash;
    }
    if (in.bad()) return unreadable(file);
  }
  if (heads.empty() && trail.records > 0 && !was_renamed(sorted->back())) {
    const auto head = sorted->back() + ".head";
    trail.findings.push_back(
        {sorted->back(), 0, "no " + head + ": the end may have been cut off", head + ", which names the last record"});
  }
  for (std::size_t i = 0; i < heads.size(); ++i)
    if (const auto& [seq, hash] = heads[i].chain; hashes[i] != hash)
      trail.findings.push_back(
          {heads[i].file, 0,
           hashes[i].empty() ? "an end at " + name_of(trail.last.seq) : name_of(seq) + " with hash " + hashes[i],
           name_of(seq) + " with hash " + hash + ", as " + heads[i].file + ".head says"});
  return trail;
}

}  // namespace rrgate
