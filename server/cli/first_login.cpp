#include "server/cli/first_login.hpp"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <memory>

#include "node/platform/secret_file.hpp"
#include "node/service/password_hash.hpp"
#include "node/tls/digest.hpp"

namespace rrgate {

namespace {

/// 20 letters and digits that are not taken for one another: 100 bits.
std::string make_password() {
  constexpr std::string_view letters = "abcdefghijkmnpqrstuvwxyz23456789";  // 32 of them, so that all are as likely
  static_assert(letters.size() == 32);
  std::string out;
  for (const auto byte : rr::random_bytes(20)) out += letters[byte % letters.size()];
  return out;
}

}  // namespace

std::vector<std::string> addresses_of_machine() {
  std::vector<std::string> out;
  ifaddrs* found = nullptr;
  if (::getifaddrs(&found) != 0) return out;
  const std::unique_ptr<ifaddrs, decltype(&::freeifaddrs)> owner(found, &::freeifaddrs);
  for (const auto* each = found; each; each = each->ifa_next) {
    if (!each->ifa_addr || each->ifa_addr->sa_family != AF_INET || (each->ifa_flags & IFF_LOOPBACK) != 0) continue;
    std::array<char, INET_ADDRSTRLEN> text{};
    const auto& address = reinterpret_cast<const sockaddr_in*>(each->ifa_addr)->sin_addr;
    if (::inet_ntop(AF_INET, &address, text.data(), text.size()) &&
        std::find(out.begin(), out.end(), text.data()) == out.end())
      out.emplace_back(text.data());
  }
  return out;
}

std::vector<std::string> names_of_machine() {
  std::vector<std::string> out;
  std::array<char, 256> name{};
  if (::gethostname(name.data(), name.size() - 1) == 0 && name[0] != 0) out.emplace_back(name.data());
  for (const auto* each : {"localhost", "127.0.0.1"})
    if (std::find(out.begin(), out.end(), each) == out.end()) out.emplace_back(each);
  for (auto& address : addresses_of_machine()) out.push_back(std::move(address));
  return out;
}

rr::Result<std::string> write_first_user(const std::filesystem::path& users_file, const std::string& name) {
  auto password = make_password();
  const auto hash = rr::PasswordHash::make_scrypt(password);
  if (!hash) return hash.error();
  const auto line = name + " " + hash->text() + " admin\n";
  if (auto done = rr::write_secret(users_file, line, false, rr::SecretReaders::folder_group); !done)
    return done.error();
  return password;
}

}  // namespace rrgate
