// Recordings of a robot that counts.
#pragma once

#include <catch2/catch.hpp>
#include <cstdint>
#include <filesystem>
#include <string>

#include "node/platform/text_file.hpp"
#include "server/json/schema.hpp"
#include "server/record/mcap.hpp"
#include "server/record/recording_writer.hpp"

namespace rrgate::test {

/// Ten seconds of a wire. `filling`  bytes that each message has besides. `begin`  in seconds.
inline void write_recording(const std::string& path, std::size_t filling = 0, int begin = 100) {
  const std::string definition = "service com.x\nstdver 0.10\nobject Robot\n    wire int32 count [readonly]\nend\n";
  rr::TypeRegistry types;
  REQUIRE(types.add({definition}, rr::RobdefMode::strict).has_value());
  RecordedService service;
  service.label = service.service = "Robot";
  service.url = "rr+tcp://h:1/?service=Robot";
  service.type = "com.x.Robot";
  service.node.name = "my.robot";
  service.definitions = {definition};
  service.objects = {{"Robot", "com.x.Robot"}};
  auto writer = RecordingWriter::create(path).value();
  REQUIRE(writer.add_service(service).has_value());
  const auto& count = *types.find_entity("com.x.Robot")->find_member("count");
  const auto channel = writer.add_member(service, "Robot", "", count, rr::named_type_schemas(types)).value();
  rr::OrderedJson message;
  message["filling"] = std::string(filling, 'x');
  for (int i = 0; i <= 10; ++i) {
    message["value"] = i;
    REQUIRE(writer.write(channel, message, rr::TimeSpec{begin + i, 0}, {begin + i, 0}).has_value());
  }
  REQUIRE(writer.close().has_value());
}

/// One that takes hours to read: it is all records without content, and takes no room on the disk.
inline void write_endless_recording(const std::string& path) {
  REQUIRE(write_text_file(path, mcap_magic));
  std::filesystem::resize_file(path, std::uintmax_t{1} << 36);
}

}  // namespace rrgate::test
