// What a progress bar draws, and when.
#include "common/terminal/progress.hpp"

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <string>

#include "tests/catch.hpp"

using namespace std::chrono_literals;
using understory::terminal::Progress;

namespace {

/// A bar whose output and clock belong to the test.
class Drawn {
 public:
  Drawn(double total, Progress::Without without, bool is_terminal)
      : file_(::open_memstream(&text_, &size_)) {
    progress_.emplace("work", total, without, Progress::Output{file_, is_terminal}, start_);
  }
  ~Drawn() {
    progress_.reset();
    std::fclose(file_);
    std::free(text_);
  }
  Drawn(const Drawn&) = delete;
  Drawn& operator=(const Drawn&) = delete;

  /// What an update so long after the start writes.
  std::string update(double done, std::chrono::milliseconds after) {
    progress_->update(done, start_ + after);
    return written();
  }
  std::string end() {
    progress_.reset();
    return written();
  }

 private:
  std::string written() {
    std::fflush(file_);
    const std::string news(text_ + read_, size_ - read_);
    read_ = size_;
    return news;
  }

  char* text_ = nullptr;
  std::size_t size_ = 0;
  std::size_t read_ = 0;
  std::FILE* file_;
  Progress::Clock::time_point start_{};
  std::optional<Progress> progress_;
};

constexpr const char* kClear = "\r\033[K";

}  // namespace

TEST_CASE("A bar in a terminal is redrawn in place and cleared at the end", "[terminal]") {
  Drawn bar(200.0, Progress::Without::kSilence, true);
  REQUIRE(bar.update(1.0, 499ms).empty());
  REQUIRE(bar.update(100.0, 500ms) ==
          kClear + std::string("work [###############...............]  50 %, 1 s left"));
  REQUIRE(bar.update(120.0, 599ms).empty());
  REQUIRE(bar.update(150.0, 30s) ==
          kClear + std::string("work [######################........]  75 %, 10 s left"));
  REQUIRE(bar.end() == kClear);
}

TEST_CASE("A short call in a terminal leaves nothing behind", "[terminal]") {
  Drawn bar(200.0, Progress::Without::kTenths, true);
  REQUIRE(bar.update(200.0, 400ms).empty());
  REQUIRE(bar.end().empty());
}

TEST_CASE("The time left is stated from one percent on", "[terminal]") {
  Drawn bar(1000.0, Progress::Without::kSeconds, false);
  const std::string empty = "work [..............................]   ";
  REQUIRE(bar.update(0.0, 4999ms).empty());
  REQUIRE(bar.update(9.0, 5s) == empty + "1 %\n");
  REQUIRE(bar.update(10.0, 9999ms).empty());
  REQUIRE(bar.update(10.0, 10s) == empty + "1 %, 16 min 30 s left\n");
  REQUIRE(bar.update(20.0, 20s) == empty + "2 %, 16 min 20 s left\n");
  REQUIRE(bar.update(500.0, 54s) == "work [###############...............]  50 %, 54 s left\n");
  REQUIRE(bar.update(500.0, 60s) ==
          "work [###############...............]  50 %, 1 min 00 s left\n");
  REQUIRE(bar.update(500.0, 3590s) ==
          "work [###############...............]  50 %, 59 min 50 s left\n");
  REQUIRE(bar.update(500.0, 1h) ==
          "work [###############...............]  50 %, 1 h 00 min left\n");
  REQUIRE(bar.update(750.0, 4h) ==
          "work [######################........]  75 %, 1 h 20 min left\n");
  REQUIRE(bar.end().empty());
}

TEST_CASE("Without a terminal every tenth has a line, or nothing is said", "[terminal]") {
  Drawn tenths(50.0, Progress::Without::kTenths, false);
  REQUIRE(tenths.update(4.0, 1s).empty());
  REQUIRE(tenths.update(5.0, 1s) == "work: 10 %\n");
  REQUIRE(tenths.update(9.0, 9s).empty());
  REQUIRE(tenths.update(60.0, 9s) == "work: 100 %\n");

  Drawn silent(50.0, Progress::Without::kSilence, false);
  REQUIRE(silent.update(25.0, 60s).empty());
  Drawn nothing(0.0, Progress::Without::kSeconds, true);
  REQUIRE(nothing.update(25.0, 60s).empty());
}
