// Configurations: every text gives a configuration or sentences about what is wrong with it. Besides bytes, options
// that exist are set to values that may not be theirs, one after another.
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <random>

#include "node/transport/schemes.hpp"
#include "server/config/cautions.hpp"
#include "server/config/config.hpp"
#include "test/fuzz/memory_bound.hpp"

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

// The dialers themselves take minutes to compile with sanitizers.
bool rr::can_dial(std::string_view scheme) {
  return scheme == "rr+tcp" || scheme == "rrs+tcp" || scheme == "rr+ws" || scheme == "rr+local";
}

std::string rr::dialable_schemes() {
  return "rr+tcp, rrs+tcp, rr+ws, rr+local";
}

namespace {

using nlohmann::json;
using namespace rrgate;

void require(bool holds, const char* rule, const std::string& detail) {
  if (holds) return;
  std::fprintf(stderr, "broken: %s: %s\n", rule, detail.c_str());
  std::abort();
}

bool is_pointer(const std::string& path) {
  return path.empty() || path.front() == '/';
}

json other_value(const OptionInfo& option, std::minstd_rand& random) {
  static const std::vector<json> any = {nullptr,
                                        true,
                                        false,
                                        0,
                                        -1,
                                        1,
                                        1.5,
                                        1e300,
                                        INT64_MAX,
                                        UINT64_MAX,
                                        "",
                                        "*",
                                        "a",
                                        "a.b",
                                        "rr+tcp://localhost:1/?service=a",
                                        "https://lab.example",
                                        "/nowhere",
                                        "\x01",
                                        std::string(300, 'a'),
                                        json::array(),
                                        json::object(),
                                        json::array({"a"}),
                                        json::object({{"a", "b"}}),
                                        json::array({0, 1}),
                                        json::array({json::object()})};
  switch (random() % 4) {
    case 0:
      if (!option.choices.empty()) return option.choices[random() % option.choices.size()];
      return option.minimum.value_or(0);
    case 1:
      if (!option.default_value.empty()) return json::parse(option.default_value, nullptr, false);
      return option.maximum ? json(*option.maximum) : json(option.type == "array" ? json::array() : json::object());
    default:
      return any[random() % any.size()];
  }
}

/// Items are the first of their array.
void set_option(json& document, const OptionInfo& option, std::minstd_rand& random) {
  auto* place = &document;
  for (std::size_t at = 1; at <= option.path.size();) {
    const auto end = std::min(option.path.find('/', at), option.path.size());
    const auto name = option.path.substr(at, end - at);
    if (name == "*") {
      if (!place->is_array()) *place = json::array();
      if (place->empty()) place->push_back(nullptr);
      place = &place->front();
    } else {
      if (!place->is_object()) *place = json::object();
      place = &(*place)[name];
    }
    at = end + 1;
  }
  *place = other_value(option, random);
}

}  // namespace

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size,
                                               unsigned int seed) {
  static const auto options = config_options();
  std::minstd_rand random(seed);
  auto document = json::parse(data, data + size, nullptr, false);
  if (document.is_discarded() || random() % 8 == 0) return LLVMFuzzerMutate(data, size, max_size);
  for (auto left = 1 + random() % 3; left > 0; --left) set_option(document, options[random() % options.size()], random);
  const auto text = document.dump(-1, ' ', false, json::error_handler_t::replace);
  if (text.size() > max_size) return LLVMFuzzerMutate(data, size, max_size);
  std::copy(text.begin(), text.end(), data);
  return text.size();
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const rr::fuzz::MemoryBound bound(size);
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto parsed = parse_config(text, "/etc/rrgate");
  for (const auto& [path, what] : parsed.findings) {
    require(is_pointer(path), "a finding says where", path);
    require(!what.empty() && what.size() < 2000, "a finding is a sentence", what);
    for (const char c : what) require(static_cast<unsigned char>(c) >= 0x20, "what is found is printable", what);
  }
  if (!parsed.findings.empty()) return 0;
  for (const auto& caution : find_cautions(parsed.config))
    require(!caution.text.empty(), "a caution is a sentence", "");
  const auto again = parse_config(text, "/etc/rrgate");
  require(again.config == parsed.config, "a text is one configuration", "");
  return 0;
}
