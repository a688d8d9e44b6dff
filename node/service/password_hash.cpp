#include "node/service/password_hash.hpp"

#include <openssl/crypto.h>
#include <openssl/evp.h>
#include <openssl/rand.h>

#include <array>
#include <charconv>
#include <optional>
#include <vector>

#include "core/support/bytes.hpp"
#include "core/support/hex.hpp"
#include "node/tls/base64.hpp"

namespace rr {

namespace {

constexpr std::string_view scrypt_prefix = "$scrypt$";
constexpr std::size_t salt_size = 16;
constexpr std::size_t hash_size = 32;
constexpr std::uint64_t max_memory = 1u << 30;

unsigned char* bytes_of(std::string& text) {
  return reinterpret_cast<unsigned char*>(text.data());
}
const unsigned char* bytes_of(std::string_view text) {
  return reinterpret_cast<const unsigned char*>(text.data());
}

// Without padding, as hashes are written.

std::string encode_unpadded(std::string_view bytes) {
  auto text = encode_base64(as_bytes(bytes));
  text.erase(text.find_last_not_of('=') + 1);
  return text;
}

/// At least `min_size` bytes.
std::optional<std::string> decode_unpadded(std::string_view text, std::size_t min_size) {
  if (text.size() > 1024 || text.ends_with('=')) return std::nullopt;
  std::string padded(text);
  padded.append((4 - text.size() % 4) % 4, '=');
  const auto bytes = decode_base64(padded);
  if (!bytes || bytes->size() < min_size) return std::nullopt;
  return std::string(bytes->begin(), bytes->end());
}

bool take(std::string_view& text, std::string_view word) {
  if (text.substr(0, word.size()) != word) return false;
  text.remove_prefix(word.size());
  return true;
}

bool take_number(std::string_view& text, std::uint32_t& number) {
  const auto parsed = std::from_chars(text.data(), text.data() + text.size(), number);
  if (parsed.ec != std::errc{}) return false;
  text.remove_prefix(static_cast<std::size_t>(parsed.ptr - text.data()));
  return true;
}

bool is_affordable(const ScryptCost& cost) {
  return cost.ln >= 1 && cost.ln <= 24 && cost.r >= 1 && cost.r <= 64 && cost.p >= 1 && cost.p <= 16 &&
         (std::uint64_t{128} * cost.r << cost.ln) <= max_memory;
}

std::optional<std::string> hash_scrypt(std::string_view password, std::string_view salt, const ScryptCost& cost) {
  std::string hash(hash_size, '\0');
  const std::uint64_t memory = (std::uint64_t{128} * cost.r << cost.ln) + (std::uint64_t{1} << 24);
  if (EVP_PBE_scrypt(password.data(), password.size(), bytes_of(salt), salt.size(), std::uint64_t{1} << cost.ln, cost.r,
                     cost.p, memory, bytes_of(hash), hash.size()) != 1)
    return std::nullopt;
  return hash;
}

std::optional<std::string> hash_md5(std::string_view password) {
  std::string hash(EVP_MAX_MD_SIZE, '\0');
  std::size_t size = 0;
  if (EVP_Q_digest(nullptr, "MD5", nullptr, password.data(), password.size(), bytes_of(hash), &size) != 1)
    return std::nullopt;
  hash.resize(size);
  return hash;
}

std::optional<std::string> parse_hex(std::string_view text) {
  std::string bytes;
  for (std::size_t i = 0; i + 1 < text.size(); i += 2) {
    const int byte = hex_byte(text.substr(i));
    if (byte < 0) return std::nullopt;
    bytes.push_back(static_cast<char>(byte));
  }
  return bytes;
}

}  // namespace

Result<PasswordHash> PasswordHash::parse(std::string_view text) {
  const auto fail = make_error(ErrorCode::invalid_argument,
                               "password hash: expected $scrypt$ln=N,r=N,p=N$SALT$HASH or 32 hex digits (MD5)");
  PasswordHash out;
  if (!take(text, scrypt_prefix)) {
    const auto hash = text.size() == 32 ? parse_hex(text) : std::nullopt;
    if (!hash) return fail;
    out.hash_ = *hash;
    return out;
  }
  out.scheme_ = PasswordScheme::scrypt;
  auto& cost = out.cost_;
  if (!take(text, "ln=") || !take_number(text, cost.ln) || !take(text, ",r=") || !take_number(text, cost.r) ||
      !take(text, ",p=") || !take_number(text, cost.p) || !take(text, "$"))
    return fail;
  const auto end_of_salt = text.find('$');
  if (end_of_salt == std::string_view::npos) return fail;
  const auto salt = decode_unpadded(text.substr(0, end_of_salt), 8);
  const auto hash = decode_unpadded(text.substr(end_of_salt + 1), hash_size);
  if (!salt || !hash || hash->size() != hash_size) return fail;
  if (!is_affordable(cost))
    return make_error(ErrorCode::invalid_argument,
                      "password hash: scrypt costs more than ln=24, r=64, p=16 or 1 GiB of memory");
  out.salt_ = *salt;
  out.hash_ = *hash;
  return out;
}

Result<PasswordHash> PasswordHash::make_scrypt(std::string_view password, ScryptCost cost) {
  PasswordHash out;
  out.scheme_ = PasswordScheme::scrypt;
  out.cost_ = cost;
  out.salt_.resize(salt_size);
  if (!is_affordable(cost) || RAND_bytes(bytes_of(out.salt_), salt_size) != 1)
    return make_error(ErrorCode::internal_error, "password hash: no random salt, or a cost that is not affordable");
  const auto hash = hash_scrypt(password, out.salt_, cost);
  if (!hash) return make_error(ErrorCode::internal_error, "password hash: OpenSSL refused scrypt");
  out.hash_ = *hash;
  return out;
}

bool PasswordHash::matches(std::string_view password) const {
  const auto hash = scheme_ == PasswordScheme::scrypt ? hash_scrypt(password, salt_, cost_) : hash_md5(password);
  return hash && hash->size() == hash_.size() && CRYPTO_memcmp(hash->data(), hash_.data(), hash_.size()) == 0;
}

std::string PasswordHash::text() const {
  if (scheme_ == PasswordScheme::md5) return hex_text(as_bytes(hash_));
  return std::string(scrypt_prefix) + "ln=" + std::to_string(cost_.ln) + ",r=" + std::to_string(cost_.r) +
         ",p=" + std::to_string(cost_.p) + "$" + encode_unpadded(salt_) + "$" + encode_unpadded(hash_);
}

}  // namespace rr
