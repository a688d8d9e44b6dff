#include "server/cli/recording_file.hpp"

#include <filesystem>
#include <iomanip>
#include <iostream>
#include <sstream>

#include "core/support/node_id.hpp"
#include "server/cli/command.hpp"
#include "server/cli/printable.hpp"
#include "server/record/recording.hpp"

namespace rrgate {

namespace {

double seconds_between(McapTime from, McapTime to) {
  return to > from ? static_cast<double>(to - from) * 1e-9 : 0;
}

rr::OrderedJson describe(const Recording& recording) {
  rr::OrderedJson out;
  out["file"] = recording.name();
  out["files"] = recording.files();
  out["bytes"] = recording.size();
  out["messages"] = recording.message_count();
  out["begin"] = mcap_time_text(recording.begin());
  out["seconds"] = seconds_between(recording.begin(), recording.end());
  out["cut"] = recording.cut().empty() ? rr::OrderedJson() : rr::OrderedJson(recording.cut());
  auto& services = out["services"] = rr::OrderedJson::array();
  for (const auto& service : recording.services()) {
    rr::OrderedJson each;
    each["name"] = service.label;
    each["type"] = service.type;
    each["url"] = service.url;
    each["node"] = service.node.name;
    each["node_id"] = rr::format_node_id(service.node.id);
    auto& members = each["members"] = rr::OrderedJson::array();
    for (const auto& [channel, member] : recording.members())
      if (member.service == service.label)
        members.push_back({{"topic", member.topic},
                           {"kind", rr::member_kind_name(member.kind)},
                           {"type", member.type},
                           {"messages", member.message_count}});
    services.push_back(std::move(each));
  }
  return out;
}

std::string with_one_digit(double number) {
  std::ostringstream out;
  out << std::fixed << std::setprecision(1) << number;
  return out.str();
}

void print_description(const rr::OrderedJson& recording) {
  const auto text = [](const rr::OrderedJson& value) { return printable(value.get<std::string>()); };
  std::cout << text(recording["file"]) << ": " << recording["messages"] << " messages in "
            << with_one_digit(recording["seconds"]) << " s from " << text(recording["begin"]) << "\n";
  if (recording["cut"].is_string())
    std::cout << "  was cut: " << text(recording["cut"]) << "; all before that is there\n";
  for (const auto& service : recording["services"]) {
    std::cout << "  " << text(service["name"]) << ": " << text(service["type"]) << " of " << text(service["url"])
              << "\n";
    for (const auto& member : service["members"])
      std::cout << "    " << text(member["topic"]) << ": " << member["messages"] << " of " << text(member["kind"])
                << (member["type"] == "" ? "" : " " + text(member["type"])) << "\n";
  }
}

}  // namespace

bool is_recording_file(const std::string& text) {
  std::error_code error;
  return text.find("://") == std::string::npos &&
         (text.ends_with(".mcap") || std::filesystem::is_regular_file(text, error));
}

int print_recording(const std::vector<std::string>& files, bool is_json) {
  const auto recording = Recording::open(files);
  if (!recording) return report_failure("info", recording.error().message);
  const auto description = describe(*recording);
  if (is_json)
    std::cout << rr::write_json(description) << "\n";
  else
    print_description(description);
  return exit_ok;
}

}  // namespace rrgate
