// Entry of every test program: runs Catch2 and lists the skipped cases after its summary.
#if __has_include(<catch2/catch_all.hpp>)
#include <catch2/catch_all.hpp>
#else
#define CATCH_CONFIG_RUNNER
#include <catch2/catch.hpp>
#endif

#include <iostream>
#include <map>
#include <stdexcept>
#include <string>

#include "tests/skip.hpp"

namespace understory::test {
namespace {

/// As Catch2 3.3 and later returns it; CMake registers it as SKIP_RETURN_CODE.
constexpr int kAllSkipped = 4;

/// What this process has run so far.
struct Progress {
  std::string running;
  int cases = 0;
  std::map<std::string, std::string> reason_of_skipped;
};

Progress& progress() {
  static Progress instance;
  return instance;
}

#if __has_include(<catch2/catch_all.hpp>)
using Listener = Catch::EventListenerBase;
#else
using Listener = Catch::TestEventListenerBase;
#endif

/// Follows which case is running.
struct CaseListener : Listener {
  using Listener::Listener;
  void testCaseStarting(const Catch::TestCaseInfo& info) override {
    progress().running = info.name;
    ++progress().cases;
  }
};
CATCH_REGISTER_LISTENER(CaseListener)

/// Standard error: reports in XML stay whole.
void print_skipped(bool has_failed) {
  const auto& skipped = progress().reason_of_skipped;
  if (skipped.empty()) return;
  std::cerr << skipped.size() << " of " << progress().cases << " cases skipped, "
            << (has_failed ? "others failed" : "none failed") << ":\n";
  for (const auto& [name, reason] : skipped) std::cerr << "  " << name << ": " << reason << '\n';
}

}  // namespace

void skip(const std::string& reason) {
  progress().reason_of_skipped[progress().running] = reason;
#ifdef SKIP
  SKIP(reason);
#endif
  // Catch2 ends the case without counting a failure: the assertion that throws this has counted it.
  throw Catch::TestFailureException();
}

}  // namespace understory::test

int main(int argc, char** argv) {
  using namespace understory::test;

  const int result = Catch::Session().run(argc, argv);
  const bool has_failed = result != 0 && result != kAllSkipped;
  print_skipped(has_failed);

  const auto skipped = static_cast<int>(progress().reason_of_skipped.size());
  return result == 0 && skipped > 0 && skipped == progress().cases ? kAllSkipped : result;
}
