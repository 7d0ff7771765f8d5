// The table of the back end's experiment, as it is printed.
#include "eval/experiments/backend/backend_table.hpp"

#include <unistd.h>

#include <cstdio>
#include <fstream>
#include <functional>
#include <iterator>
#include <nlohmann/json.hpp>

#include "tests/catch.hpp"
#include "tests/scratch.hpp"

using namespace understory;
using namespace understory::eval::experiments::backend;

namespace {

/// What is printed to standard output meanwhile.
std::string printed(const std::function<void()>& print) {
  const test::Scratch folder("backend-table");
  const std::string path = (folder.path() / "stdout").string();
  std::fflush(stdout);
  const int before = ::dup(STDOUT_FILENO);
  REQUIRE(std::freopen(path.c_str(), "w", stdout) != nullptr);
  print();
  std::fflush(stdout);
  ::dup2(before, STDOUT_FILENO);
  ::close(before);
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

/// The cell of a row below a word of the heading; cells end where their headings end.
std::string cell_below(const std::string& heading, const std::string& row,
                       const std::string& word) {
  const auto end = heading.find(word) + word.size();
  const auto begin = row.find_last_of(" |", end - 1) + 1;
  return row.substr(begin, end - begin);
}

}  // namespace

TEST_CASE("Numbers are below their headings, in their units", "[eval][backend]") {
  const nlohmann::json row{{"dataset", "grid"},   {"poses", 600},
                           {"factors", 777},      {"total_s", 1.25},
                           {"ms_p50", 0.125},     {"ms_p99", 4.5},
                           {"ms_max", 9.75},      {"settle_s", 0.0123},
                           {"whole_ms", 33.5},    {"rss_mb", 42.0},
                           {"chi2_final", 101.0}, {"chi2_batch", 100.0},
                           {"error", ""},         {"moments", {{"excess_p50", 0.015}}}};
  const std::string heading = printed([] { print_heading(); });
  const std::string line = printed([&] { print_row(row); });
  const auto cell = [&](const std::string& word) { return cell_below(heading, line, word); };
  CHECK(cell("poses") == "600");
  CHECK(cell("edges") == "777");
  CHECK(cell("total s") == "1.25");
  CHECK(cell("p50 ms") == "0.125");
  CHECK(cell("p99 ms") == "4.50");
  CHECK(cell("max ms") == "9.75");
  CHECK(cell("settle") == "12.3");  // ms
  CHECK(cell("whole") == "33.50");  // ms
  CHECK(cell("exc50 %") == "1.5000");
  CHECK(cell("excess") == "1.0000%");
  CHECK(cell("RSS MB") == "42");
}
