// Certificates of strangers: whose node they say to be of. Input: certificates in DER, the peer's first.
#include <cstdlib>

#include "core/session/start_tls.hpp"
#include "node/tls/node_certificate_check.hpp"
#include "node/tls/openssl.hpp"
#include "test/fuzz/memory_bound.hpp"

namespace {

namespace openssl = rr::openssl;
using Store = std::unique_ptr<X509_STORE, openssl::Free<X509_STORE_free>>;
using StoreContext = std::unique_ptr<X509_STORE_CTX, openssl::Free<X509_STORE_CTX_free>>;

constexpr int max_certificates = 4;

void require(bool claim) {
  if (!claim) std::abort();
}

void check(const rr::Result<rr::NodeId>& node, X509* certificate) {
  if (!node) {
    require(node.error().message.size() < 1000);
    for (const char c : node.error().message) require(static_cast<unsigned char>(c) >= 0x20);
    return;
  }
  const auto name = openssl::name_text(X509_get_subject_name(certificate));
  require(name == rr::quote("CN = " + rr::format_certificate_name(*node), 120));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const rr::fuzz::MemoryBound bound(size);
  const openssl::Chain chain(sk_X509_new_null());
  const unsigned char* at = data;
  while (at < data + size && sk_X509_num(chain.get()) < max_certificates) {
    X509* const read = d2i_X509(nullptr, &at, data + size - at);
    if (!read) break;
    sk_X509_push(chain.get(), read);
  }
  const int count = sk_X509_num(chain.get());
  if (count > 0) {
    X509* const peer = sk_X509_value(chain.get(), 0);
    check(rr::read_node_chain(chain.get()), peer);
    // The same with signatures and dates, the last being trusted.
    const Store trusted(X509_STORE_new());
    X509_STORE_add_cert(trusted.get(), sk_X509_value(chain.get(), count - 1));
    const StoreContext context(X509_STORE_CTX_new());
    X509_STORE_CTX_init(context.get(), trusted.get(), peer, chain.get());
    check(rr::check_node_chain(context.get()), peer);
  }
  ERR_clear_error();
  return 0;
}
