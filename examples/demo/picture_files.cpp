#include "examples/demo/picture_files.hpp"

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <span>
#include <vector>

#include "examples/demo/jpeg_picture.hpp"

namespace rrgate::demo {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t max_picture_files = 10'000;
constexpr std::uintmax_t max_picture_file_bytes = 64u * 1024 * 1024;
constexpr std::uintmax_t max_stream_file_bytes = 256u * 1024 * 1024;

std::string extension_of(const fs::path& file) {
  auto extension = file.extension().string();
  for (char& letter : extension) letter = static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
  return extension;
}

bool is_picture_name(const fs::path& file) {
  return extension_of(file) == ".jpg" || extension_of(file) == ".jpeg";
}

/// Returns a sentence about what went wrong.
std::string read_picture_file(const fs::path& file, std::uintmax_t limit, std::vector<std::uint8_t>& bytes) {
  std::error_code error;
  const bool is_file = fs::is_regular_file(file, error);
  const auto size = is_file ? fs::file_size(file, error) : 0;
  if (!is_file || error) return file.string() + " can't be read: " + (error ? error.message() : "it is no file");
  if (size > limit)
    return file.string() + " has " + std::to_string(size) + " bytes, expected at most " + std::to_string(limit);
  bytes.resize(static_cast<std::size_t>(size));
  std::ifstream stream(file, std::ios::binary);
  stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  return stream ? "" : file.string() + " can't be read";
}

class PictureFolder : public FrameSource {
 public:
  PictureFolder(std::string name, std::vector<fs::path> files) : name_(std::move(name)), files_(std::move(files)) {}

  std::string name() const override { return name_; }
  void take(Taken taken) override {
    const auto& file = files_[next_];
    next_ = (next_ + 1) % files_.size();
    std::vector<std::uint8_t> bytes;
    if (auto problem = read_picture_file(file, max_picture_file_bytes, bytes); !problem.empty())
      return taken({{}, std::move(problem)});
    auto result = decode_jpeg(bytes);
    if (!result.problem.empty()) result.problem = file.string() + ": " + result.problem;
    taken(std::move(result));
  }

 private:
  std::string name_;
  std::vector<fs::path> files_;  ///< one at least
  std::size_t next_ = 0;
};

/// Pictures one after another; what lies between them, as the headers of a multipart stream, is passed over.
class MotionJpegFile : public FrameSource {
 public:
  MotionJpegFile(std::string name, std::vector<std::uint8_t> bytes)
      : name_(std::move(name)), bytes_(std::move(bytes)) {}

  std::string name() const override { return name_; }
  void take(Taken taken) override {
    auto begin = find_picture();
    if (begin == bytes_.size() && position_ != 0) {
      position_ = 0;
      begin = find_picture();
    }
    if (begin == bytes_.size()) return taken({{}, name_ + " holds no JPEG picture"});
    std::size_t used = 2;  // where it is damaged, the next is looked for behind its first two bytes
    auto result = decode_jpeg(std::span(bytes_).subspan(begin), &used);
    position_ = begin + used;
    if (!result.problem.empty()) result.problem = name_ + " at byte " + std::to_string(begin) + ": " + result.problem;
    taken(std::move(result));
  }

 private:
  std::size_t find_picture() const {
    static constexpr std::uint8_t start_of_image[] = {0xff, 0xd8, 0xff};
    const auto from = bytes_.begin() + static_cast<std::ptrdiff_t>(position_);
    const auto found = std::search(from, bytes_.end(), std::begin(start_of_image), std::end(start_of_image));
    return static_cast<std::size_t>(found - bytes_.begin());
  }

  std::string name_;
  std::vector<std::uint8_t> bytes_;
  std::size_t position_ = 0;
};

std::vector<fs::path> list_pictures(const fs::path& folder, std::string& problem) {
  std::vector<fs::path> files;
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    if (!is_picture_name(at->path())) continue;
    if (files.size() == max_picture_files) {
      problem = folder.string() + " holds more than " + std::to_string(max_picture_files) + " pictures";
      return {};
    }
    files.push_back(at->path());
  }
  if (error) problem = folder.string() + " can't be read: " + error.message();
  if (!error && files.empty()) problem = folder.string() + " holds no .jpg or .jpeg file";
  std::sort(files.begin(), files.end());
  return files;
}

std::unique_ptr<FrameSource> make_picture_source(const fs::path& path, std::string& problem) {
  std::error_code error;
  const auto status = fs::status(path, error);
  const auto name = path.filename().empty() ? path.string() : path.filename().string();
  if (!fs::exists(status)) {
    problem = path.string() + " can't be read: " + (error ? error.message() : "it is not there");
  } else if (fs::is_directory(status)) {
    auto files = list_pictures(path, problem);
    if (problem.empty()) return std::make_unique<PictureFolder>(name, std::move(files));
  } else if (is_picture_name(path)) {
    return std::make_unique<PictureFolder>(name, std::vector{path});
  } else if (extension_of(path) == ".mjpeg") {
    std::vector<std::uint8_t> bytes;
    problem = read_picture_file(path, max_stream_file_bytes, bytes);
    if (problem.empty()) return std::make_unique<MotionJpegFile>(path.string(), std::move(bytes));
  } else {
    problem = path.string() + " is not known: expected a folder, or a .jpg, .jpeg or .mjpeg file";
  }
  return nullptr;
}

}  // namespace

std::unique_ptr<FrameSource> open_picture_files(const std::string& path, std::string& problem) {
  problem.clear();
  auto first_look = make_picture_source(path, problem);
  if (!first_look) return nullptr;
  first_look->take([&](FrameResult result) { problem = std::move(result.problem); });
  if (!problem.empty()) return nullptr;
  return make_picture_source(path, problem);  // which begins with the first again
}

}  // namespace rrgate::demo
