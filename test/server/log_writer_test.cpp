#include "server/log/log_writer.hpp"

#include <unistd.h>

#include <catch2/catch.hpp>
#include <mutex>
#include <string>
#include <vector>

using namespace rrgate;
using std::chrono::milliseconds;
using std::chrono::seconds;

namespace {

struct Pipe {
  int ends[2] = {-1, -1};
  Pipe() { REQUIRE(::pipe(ends) == 0); }
  ~Pipe() {
    ::close(ends[0]);
    ::close(ends[1]);
  }
  std::string read(std::size_t size) const {
    std::string out(size, ' ');
    for (std::size_t got = 0; got < size;) {
      const auto count = ::read(ends[0], out.data() + got, size - got);
      REQUIRE(count > 0);
      got += static_cast<std::size_t>(count);
    }
    return out;
  }
};

struct Told {
  std::mutex mutex;
  std::vector<std::uint64_t> counts;
  std::function<void(std::uint64_t)> hearer() {
    return [this](std::uint64_t count) {
      const std::lock_guard lock(mutex);
      counts.push_back(count);
    };
  }
};

}  // namespace

TEST_CASE("lines of the log come in order") {
  Pipe pipe;
  Told told;
  LogWriter writer(pipe.ends[1], 1000, told.hearer());
  std::string all;
  for (int i = 0; i < 50; ++i) {
    const auto line = std::to_string(i) + "\n";
    writer.add(line);
    all += line;
  }
  CHECK(writer.flush(seconds(10)));
  CHECK(pipe.read(all.size()) == all);
  CHECK(writer.lost() == 0);
  CHECK(told.counts.empty());
}

TEST_CASE("a log that nobody reads keeps nobody waiting; what does not fit is counted, and told of once it is read") {
  Pipe pipe;
  Told told;
  const std::string line = std::string(999, 'x') + "\n";
  {
    // An end that stays open: the writer's thread may still be writing when the test is over.
    LogWriter writer(::dup(pipe.ends[1]), 100'000, told.hearer());
    constexpr std::uint64_t added = 1000;  // a pipe holds 64 KiB
    for (std::uint64_t i = 0; i < added; ++i) writer.add(line);
    const auto lost = writer.lost();
    CHECK(lost > 500);
    CHECK_FALSE(writer.flush(milliseconds(0)));
    const auto kept = (added - lost) * line.size();
    CHECK(pipe.read(kept).size() == kept);
    CHECK(writer.flush(seconds(10)));
    CHECK(told.counts == std::vector<std::uint64_t>{lost});
    writer.add("after\n");
    CHECK(pipe.read(6) == "after\n");
    for (std::uint64_t i = 0; i < added; ++i) writer.add(line);
  }  // does not wait for what nobody reads
  CHECK(told.counts.size() == 1);
}

TEST_CASE("lines that can't be written count as lost") {
  Told told;
  LogWriter writer(-1, 1000, told.hearer());
  writer.add("one\n");
  CHECK(writer.flush(seconds(10)));
  CHECK(writer.lost() == 1);
}
