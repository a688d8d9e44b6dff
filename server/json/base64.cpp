#include "server/json/base64.hpp"

#include <boost/beast/core/detail/base64.hpp>

namespace rr {

namespace base64 = boost::beast::detail::base64;

std::string encode_base64(ByteSpan bytes) {
  std::string out(base64::encoded_size(bytes.size()), '\0');
  out.resize(base64::encode(out.data(), bytes.data(), bytes.size()));
  return out;
}

std::optional<Bytes> decode_base64(std::string_view text) {
  if (text.size() % 4 != 0) return std::nullopt;
  Bytes out(base64::decoded_size(text.size()));
  out.resize(base64::decode(out.data(), text.data(), text.size()).first);
  // The decoder takes other spellings of the same bytes; here there is one.
  if (encode_base64(out) != text) return std::nullopt;
  return out;
}

}  // namespace rr
