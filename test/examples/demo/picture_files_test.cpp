#include "examples/demo/picture_files.hpp"

#include <unistd.h>

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>

#include "test/examples/demo/jpeg_writer.hpp"

using namespace rrgate::demo;
using Catch::Matchers::Contains;

namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<std::uint8_t>;

class PictureTestFolder {
 public:
  PictureTestFolder() {
    std::string name = (fs::temp_directory_path() / "rrgate-pictures-XXXXXX").string();
    REQUIRE(::mkdtemp(name.data()));
    path_ = name;
  }
  ~PictureTestFolder() { fs::remove_all(path_); }
  PictureTestFolder(const PictureTestFolder&) = delete;
  PictureTestFolder& operator=(const PictureTestFolder&) = delete;

  std::string write(const std::string& name, const Bytes& bytes) const {
    std::ofstream(path_ / name, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    return (path_ / name).string();
  }
  std::string path() const { return path_.string(); }

 private:
  fs::path path_;
};

FrameResult take_now(FrameSource& source) {
  FrameResult taken{{}, "was not called"};
  source.take([&](FrameResult result) { taken = std::move(result); });
  return taken;
}

int width_of_next(FrameSource& source) {
  const auto taken = take_now(source);
  CHECK(taken.problem.empty());
  return taken.image.width;
}

std::string problem_of(const std::string& path) {
  std::string problem;
  CHECK_FALSE(open_picture_files(path, problem));
  return problem;
}

Bytes joined(std::initializer_list<Bytes> parts) {
  Bytes all;
  for (const auto& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

Bytes text(std::string_view letters) {
  return {letters.begin(), letters.end()};
}

}  // namespace

TEST_CASE("the pictures of a folder follow one another by their names, again and again") {
  const PictureTestFolder folder;
  folder.write("b.JPG", make_jpeg(20, 8, {}));
  folder.write("a.jpeg", make_jpeg(10, 8, {}));
  folder.write("c.jpg", make_jpeg(30, 8, {}));
  folder.write("notes.txt", text("no picture"));
  std::string problem;
  const auto source = open_picture_files(folder.path(), problem);
  REQUIRE(source);
  CHECK(source->name() == fs::path(folder.path()).filename());
  for (const int width : {10, 20, 30, 10, 20}) CHECK(width_of_next(*source) == width);

  folder.write("c.jpg", text("damaged"));
  CHECK_THAT(take_now(*source).problem, Contains("c.jpg"));
  fs::remove(folder.path() + "/a.jpeg");
  CHECK_THAT(take_now(*source).problem, Contains("a.jpeg"));
  CHECK(width_of_next(*source) == 20);
}

TEST_CASE("a Motion JPEG file is shown from its beginning to its end, with or without headers between its pictures") {
  const PictureTestFolder folder;
  const auto path =
      folder.write("film.mjpeg", joined({text("--frame\r\nContent-Type: image/jpeg\r\n\r\n"), make_jpeg(10, 8, {}),
                                         text("\r\n--frame\r\n\r\n"), make_jpeg(20, 8, {}), make_jpeg(30, 8, {})}));
  std::string problem;
  const auto source = open_picture_files(path, problem);
  REQUIRE(source);
  for (const int width : {10, 20, 30, 10, 20}) CHECK(width_of_next(*source) == width);
}

TEST_CASE("a damaged picture in a Motion JPEG file is told, and the next one is shown") {
  const PictureTestFolder folder;
  auto damaged = make_jpeg(20, 8, {});
  damaged.resize(damaged.size() / 4);
  const auto path = folder.write("film.mjpeg", joined({make_jpeg(10, 8, {}), damaged, make_jpeg(30, 8, {}), {0xff}}));
  std::string problem;
  const auto source = open_picture_files(path, problem);
  REQUIRE(source);
  CHECK(width_of_next(*source) == 10);
  CHECK_THAT(take_now(*source).problem, Contains("film.mjpeg at byte"));
  CHECK(width_of_next(*source) == 30);
  CHECK(width_of_next(*source) == 10);
}

TEST_CASE("one picture stays") {
  const PictureTestFolder folder;
  std::string problem;
  const auto source = open_picture_files(folder.write("one.jpg", make_jpeg(10, 8, {})), problem);
  REQUIRE(source);
  CHECK(width_of_next(*source) == 10);
  CHECK(width_of_next(*source) == 10);
}

TEST_CASE("what holds no pictures is refused at once") {
  const PictureTestFolder folder;
  CHECK_THAT(problem_of(folder.path()), Contains("holds no .jpg or .jpeg file"));
  CHECK_THAT(problem_of(folder.path() + "/nothing"), Contains("nothing can't be read"));
  CHECK_THAT(problem_of(folder.write("x.png", text("x"))), Contains("expected a folder, or a .jpg, .jpeg or .mjpeg"));
  CHECK_THAT(problem_of(folder.write("x.mjpeg", text("no JPEG"))), Contains("holds no JPEG picture"));
  CHECK_THAT(problem_of(folder.write("empty.mjpeg", {})), Contains("holds no JPEG picture"));
  CHECK_THAT(problem_of(folder.write("x.jpg", text("no JPEG"))), Contains("FF D8"));
  fs::create_directory(folder.path() + "/y.jpg");
  fs::remove(folder.path() + "/x.jpg");
  CHECK_THAT(problem_of(folder.path()), Contains("y.jpg can't be read: it is no file"));
}

TEST_CASE("files that are too large are not read") {
  const PictureTestFolder folder;
  for (const std::string name : {"large.mjpeg", "large.jpg"}) {
    const auto path = folder.write(name, {0xff, 0xd8, 0xff});
    fs::resize_file(path, 257u * 1024 * 1024);  // takes no room on the disk
    CHECK_THAT(problem_of(path), Contains("269484032 bytes, expected at most"));
  }
}
