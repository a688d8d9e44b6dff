// Writes the golden messages as seeds: make_wire_seeds <folder>. One folder a fuzzer is made below it.
#include <filesystem>
#include <fstream>
#include <iostream>

#include "test/core/wire/coded_message.hpp"
#include "test/core/wire/vectors.hpp"

namespace {

constexpr std::size_t max_seed_size = 4096;  // longer inputs only slow the fuzzer down

void write_seed(const std::filesystem::path& path, const rr::Bytes& bytes) {
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: make_wire_seeds <folder>\n";
    return 2;
  }
  const std::filesystem::path root = argv[1];
  for (const auto* name : {"fuzz_codec_v2", "fuzz_codec_v4", "fuzz_frame_scanner", "fuzz_unpack"})
    std::filesystem::create_directories(root / name);
  const auto add = [&root](const std::string& name, const rr::Bytes& bytes) {
    if (bytes.size() < 10 || bytes.size() > max_seed_size) return;
    write_seed(root / (bytes[8] == 2 ? "fuzz_codec_v2" : "fuzz_codec_v4") / name, bytes);
    rr::Bytes pieces{3, 0, 8, 90};  // three piece sizes: 1, 9, 91 bytes
    for (int copy = 0; copy < 2; ++copy) pieces.insert(pieces.end(), bytes.begin(), bytes.end());
    write_seed(root / "fuzz_frame_scanner" / name, pieces);
  };
  for (const auto& vector : rr::test::message_vectors()) add(vector.name, vector.bytes);
  for (const auto& vector : rr::test::malformed_vectors()) add(vector.name, vector.bytes);
  add("coded_texts",
      rr::test::coded_message(std::string(1000, 'a'), rr::test::coded_map(rr::test::coded_element(), 9), 20));
  const auto map = rr::test::coded_map(rr::test::coded_element(), 1);
  rr::Bytes maps{'*'};
  maps.insert(maps.end(), map.begin(), map.end());
  write_seed(root / "fuzz_unpack" / "coded_texts", maps);
  return 0;
}
