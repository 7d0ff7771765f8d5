// `eval backend` on files that are no graph, or a graph in an awkward order.
#include <algorithm>
#include <nlohmann/json.hpp>

#include "tests/catch.hpp"
#include "tests/cli/run_command.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;

namespace {

const std::string kInformation = " 100 0 0 100 0 100\n";
const std::string kLine =
    "VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1 0 0\nVERTEX_SE2 2 2 0 0\nVERTEX_SE2 3 3 0 0\n";
const std::string kGood = kLine + "EDGE_SE2 0 1 1 0 0" + kInformation + "EDGE_SE2 1 2 1 0 0" +
                          kInformation + "EDGE_SE2 2 3 1 0 0" + kInformation;

struct Backend {
  test::TemporaryDirectory directory;

  std::string write(const std::string& name, const std::string& text) {
    const auto file = directory / name;
    write_bytes(file, test::Bytes(text.begin(), text.end()));
    return file.string();
  }
  test::Outcome run(const std::string& arguments) {
    return understory_command(directory, "eval backend --no-plots --data " + arguments);
  }
};

}  // namespace

TEST_CASE_METHOD(Backend, "a graph that cannot be meant is named, the others go on", "[cli]") {
  const std::string good = write("good.g2o", kGood);
  const std::string bad = write("bad.g2o", kGood + "EDGE_SE2 0 3 3 0 0 100 0 0 -100 0 100\n");
  const std::string json = (directory / "out.json").string();
  const auto outcome = run(bad + " " + good + " --json " + json);
  CAPTURE(outcome.error);
  CHECK(outcome.status == 1);
  CHECK_THAT(outcome.error,
             Contains("bad.g2o, line 8: edge 0 - 3: the information is not positive"));
  CHECK_THAT(outcome.error, Contains("1 of 2 files refused"));
  CHECK_THAT(outcome.out, Contains("good") && !Contains("nan"));
  CHECK(nlohmann::json::parse(read_text(json))["rows"].size() == 1);

  const std::pair<std::string, std::string> others[] = {
      {"", "neither a vertex nor an edge"},
      {std::string("\x7F"
                   "ELF\0\1\2\n\xFF\xFE\n",
                   11),
       "neither a vertex nor an edge"},
      {kLine, "no edge in it"},
      {kGood + "VERTEX_SE2 9 5 5 0\n", "vertex 9: no edges lead from it to the first pose, 0"},
      {kGood + "VERTEX_SE2 8 5 5 0\nVERTEX_SE2 9 5 5 0\nEDGE_SE2 8 9 1 0 0" + kInformation,
       "line 10: vertex 8: no edges lead"},
      {kGood + "EDGE_SE2 0 7 1 0 0" + kInformation, "line 8: edge to vertex 7, which is not"}};
  for (const auto& [text, message] : others) {
    const auto refused = run(write("other.g2o", text));
    CAPTURE(message, refused.error);
    CHECK(refused.status == 1);
    CHECK_THAT(refused.error, Contains("other.g2o") && Contains(message));
  }
}

TEST_CASE_METHOD(Backend, "lines that are passed over are counted", "[cli]") {
  const auto outcome = run(write("a.g2o", "EQUIV 1 2\nEQUIV 3 4\n" + kGood + "ROBOT\x1B[2J\n"));
  CAPTURE(outcome.error);
  CHECK(outcome.status == 0);
  CHECK_THAT(outcome.error, Contains("2 lines \"EQUIV\" passed over, the first is line 1"));
  CHECK_THAT(outcome.error, Contains("1 lines \"ROBOT\\x1b[2J\" passed over"));
}

TEST_CASE_METHOD(Backend, "only one pose is held fast, whatever the order of the edges", "[cli]") {
  // Pose 2 is measured from pose 3 alone: the youngest edge of pose 3 has no placed end.
  const std::string awkward = kLine + "EDGE_SE2 0 1 1 0 0" + kInformation + "EDGE_SE2 2 3 1 0 0" +
                              kInformation + "EDGE_SE2 1 3 2 0 0" + kInformation;
  const std::string json = (directory / "out.json").string();
  REQUIRE(run(write("awkward.g2o", awkward) + " --json " + json).status == 0);
  const auto row = nlohmann::json::parse(read_text(json))["rows"][0];
  CHECK(row["chi2_final"].get<double>() < 1e-9);
  CHECK(row["chi2_odometry"].get<double>() < 1e-9);
}
