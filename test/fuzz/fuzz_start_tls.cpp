// What strangers say before TLS: the first message of a client, a service's answer, a name in a certificate.
#include <cstdlib>

#include "core/session/start_tls.hpp"
#include "test/fuzz/memory_bound.hpp"

namespace {

const rr::NodeId own_id{{0x11, 0x22}};

void check(bool is_true) {
  if (!is_true) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const rr::fuzz::MemoryBound bound(size);
  const rr::ByteSpan bytes(data, size);
  const rr::NodeIdentity self{own_id, "fuzz.node"};
  for (const bool can_start_tls : {false, true}) {
    const auto request = rr::answer_first_request(bytes, self, can_start_tls);
    if (!request || request->kind != rr::FirstRequest::Kind::start_tls) continue;
    // What we answer, a client of ours understands.
    check(request->refusal.has_value() || can_start_tls);
    if (request->reply.empty()) continue;
    const auto reply = rr::read_start_tls_reply(request->reply, {own_id, ""});
    check(reply.has_value() == !request->refusal.has_value());
    if (reply) check(reply->peer == own_id);
  }
  static_cast<void>(rr::refuse_first_request(bytes, self, rr::protocol_error("no")));
  for (const auto& target : {rr::NodeIdentity{}, rr::NodeIdentity{own_id, ""}, rr::NodeIdentity{{}, "fuzz.node"}})
    if (const auto reply = rr::read_start_tls_reply(bytes, target)) {
      check(!reply->peer.is_any());
      check(target.id.is_any() || reply->peer == target.id);
    }
  if (const auto id = rr::parse_certificate_name(rr::as_text(bytes)))
    check(rr::format_certificate_name(*id) == rr::as_text(bytes));
  return 0;
}
