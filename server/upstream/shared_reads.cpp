#include "server/upstream/shared_reads.hpp"

namespace rrgate {

std::shared_ptr<const SharedReads::Read> SharedReads::join(const UpstreamClient& client, const Key& key,
                                                           Completion done) {
  const auto command = commands_.find(&client);
  auto& newest = newest_[key];
  if (newest && (command == commands_.end() || command->second < newest->begun)) {
    newest->readers.push_back(std::move(done));
    return nullptr;
  }
  newest = std::make_shared<Read>(Read{key, ++last_step_});
  newest->readers.push_back(std::move(done));
  return newest;
}

void SharedReads::handle_answer(const std::shared_ptr<const Read>& read, const rr::Result<rr::Value>& value) {
  if (const auto found = newest_.find(read->key); found != newest_.end() && found->second == read) newest_.erase(found);
  for (const auto& reader : read->readers) reader(value);
}

}  // namespace rrgate
