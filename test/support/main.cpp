// Catch2's own program, in which a test that asserted nothing has failed: it could never do otherwise.
#define CATCH_CONFIG_RUNNER
#if defined(__GNUC__) && !defined(__clang__)
// GCC 12 with -fsanitize=address takes std::regex's states, which Catch2 compiles here, for uninitialized.
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif
#include <catch2/catch.hpp>
#include <iostream>
#include <string>

namespace {

using Listener = Catch::TestEventListenerBase;

/// Looks at each way through a test case, with the sections that lie on it. (Catch2's own --warn NoAssertions asks for
/// an assertion within every innermost section, where those behind it may be meant.)
class Assertions : public Listener {
 public:
  using Listener::Listener;
  static inline bool are_missing = false;

  void testCaseStarting(const Catch::TestCaseInfo& test) override {
    Listener::testCaseStarting(test);
    way_ = test.name;
  }
  void sectionStarting(const Catch::SectionInfo& section) override {
    Listener::sectionStarting(section);
    if (depth_++ > 0) way_ += " / " + section.name;
  }
  void sectionEnded(const Catch::SectionStats& stats) override {
    if (--depth_ == 0) {
      if (stats.assertions.total() == 0) {
        are_missing = true;
        std::cerr << "asserted nothing: " << way_ << "\n";
      }
      way_ = stats.sectionInfo.name;
    }
    Listener::sectionEnded(stats);
  }

 private:
  std::string way_;
  int depth_ = 0;
};

CATCH_REGISTER_LISTENER(Assertions)

}  // namespace

int main(int argc, char** argv) {
  const int result = Catch::Session().run(argc, argv);
  return result == 0 && Assertions::are_missing ? 1 : result;
}
