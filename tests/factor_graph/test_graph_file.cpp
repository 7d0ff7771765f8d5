#include "common/factor_graph/files/graph_file.hpp"

#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "common/factor_graph/batch/batch.hpp"
#include "common/factor_graph/files/g2o_writer.hpp"
#include "tests/catch.hpp"
#include "tests/data.hpp"

using namespace understory;
using namespace understory::factor_graph::graph;

namespace {

factor_graph::files::GraphFile require_graph(const std::string& text) {
  auto result = read_graph(text, factor_graph::files::guess_format(text));
  REQUIRE(std::holds_alternative<factor_graph::files::GraphFile>(result));
  return std::get<factor_graph::files::GraphFile>(result);
}

/// The file's graph at the file's estimates, the first pose held fast.
void fill(factor_graph::graph::FactorGraph& graph, const factor_graph::files::GraphFile& file) {
  for (const factor_graph::files::GraphFile::Vertex& vertex : file.vertices)
    graph.add(vertex.type, vertex.value);
  for (const Factor& factor : file.factors) graph.add(factor);
  if (file.vertices.front().type == VariableType::kPose2) {
    graph.add(prior(VariableId(0), pose2_of(file.vertices[0].value),
                    Eigen::Matrix3d(1e8 * Eigen::Matrix3d::Identity())));
  } else {
    graph.add(prior(VariableId(0), pose3_of(file.vertices[0].value),
                    Eigen::Matrix<double, 6, 6>(1e8 * Eigen::Matrix<double, 6, 6>::Identity())));
  }
}

}  // namespace

TEST_CASE("Each format has its own order of the information", "[graph_file]") {
  const factor_graph::files::GraphFile toro =
      require_graph("VERTEX2 0 0 0 0\nVERTEX2 1 1 0 0\nEDGE2 0 1 1 0 0 11 12 22 33 13 23\n");
  Eigen::Matrix3d expected;
  expected << 11, 12, 13, 12, 22, 23, 13, 23, 33;
  REQUIRE(toro.factors.at(0).information.isApprox(expected));
  const factor_graph::files::GraphFile g2o = require_graph(
      "VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1 0 0\nEDGE_SE2 0 1 1 0 0 11 12 13 22 23 33\n");
  REQUIRE(g2o.factors.at(0).information.isApprox(expected));
  const factor_graph::files::GraphFile isam =
      require_graph("ODOMETRY 0 1 1 0 0 1 2 3 4 5 6\nLANDMARK 1 1 2 3 7 8 9\n");
  Eigen::Matrix3d root;
  root << 1, 2, 3, 0, 4, 5, 0, 0, 6;
  REQUIRE(isam.factors.at(0).information.isApprox(root.transpose() * root));
  Eigen::Matrix2d landmark_root;
  landmark_root << 7, 8, 0, 9;
  REQUIRE(isam.factors.at(1).information.isApprox(landmark_root.transpose() * landmark_root));
  REQUIRE(isam.vertices.size() == 3);  // A landmark's number is no pose's.
}

TEST_CASE("A malformed line is named", "[graph_file]") {
  for (const std::string line :
       {"EDGE_SE2 0 1 1 0 0 11 12 13 22 23", "EDGE_SE2 0 1 1 0 x 1 0 0 1 0 1",
        "EDGE_SE2 0 1 1 0 nan 1 0 0 1 0 1", "VERTEX_SE2 0 0 0 0",
        "EDGE_SE2 0.5 1 1 0 0 1 0 0 1 0 1", "EDGE_SE2_XY 0 1 1 1 1 0 1"}) {
    const std::string text = "VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1 0 0\n" + line + "\n";
    const auto result = read_graph(text, factor_graph::files::GraphFormat::kG2o);
    REQUIRE(std::holds_alternative<factor_graph::files::GraphFileError>(result));
    REQUIRE(std::get<factor_graph::files::GraphFileError>(result).line == 3);
  }
}

TEST_CASE("What a graph cannot mean is refused, with line and edge", "[graph_file]") {
  const std::string se2 = "VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1 0 0\n";
  const std::string se3 =
      "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\nVERTEX_SE3:QUAT 1 1 0 0 0 0 0 1\nVERTEX_TRACKXYZ 2 1 1 1\n";
  const std::string identity = " 1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1\n";
  struct Case {
    std::string text;
    int line;
    std::string what;
  };
  const Case cases[] = {
      {se2 + "EDGE_SE2 0 1 1 0 0 1 0 0 -1 0 1\n", 3, "edge 0 - 1: the information is not positive"},
      {se2 + "EDGE_SE2 0 1 1 0 0 1 2 0 1 0 1\n", 3, "edge 0 - 1: the information is not positive"},
      {se2 + "EDGE_SE2 0 1 1e200 0 0 1 0 0 1 0 1\n", 3, "beyond 1e30"},
      {se2 + "EDGE_SE2 0 1 1 0 0 1e200 0 0 1 0 1\n", 3, "beyond 1e30"},
      {"VERTEX_SE2 0 -1e200 0 0\nEDGE_SE2 0 0 1 0 0 1 0 0 1 0 1\n", 1, "beyond 1e30"},
      {se2 + "EDGE_SE 0 1 1 0 0 1 0 0 1 0 1\n", 3, "part of a tag"},
      {se2 + "DGE_SE2 0 1 1 0 0 1 0 0 1 0 1\n", 3, "part of a tag"},
      {se2 + "EDGE_SE2 0 5 1 0 0 1 0 0 1 0 1\n", 3, "vertex 5, which is not in the file"},
      {se2 + "EDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\nFIX 5\n", 4, "vertex 5 is not in the file"},
      {se3 + "EDGE_SE3:QUAT 0 1 1 0 0 0 0 0 0" + identity, 4, "quaternion is zero"},
      {"VERTEX_SE3:QUAT 0 0 0 0 0 0 0 0\n", 1, "quaternion is zero"},
      {"PARAMS_SE3OFFSET 0 0 0 1 0 0 0 1\n" + se3, 1, "not the identity"},
      {"PARAMS_SE2OFFSET 0 0 0 0.5\n" + se2, 1, "not the identity"},
      {"", 0, "neither a vertex nor an edge"},
      {std::string("\0\1\2\xFF", 4), 0, "neither a vertex nor an edge"},
  };
  for (const auto& [text, line, what] : cases) {
    const auto result = read_graph(text, factor_graph::files::GraphFormat::kG2o);
    CAPTURE(text, what);
    REQUIRE(std::holds_alternative<factor_graph::files::GraphFileError>(result));
    const auto& error = std::get<factor_graph::files::GraphFileError>(result);
    CHECK(error.line == line);
    CHECK(error.what.find(what) != std::string::npos);
  }
}

TEST_CASE("Unknown tags are counted, and an offset of none is one", "[graph_file]") {
  const auto graph = require_graph(
      "PARAMS_SE3OFFSET 0 0 0 0 0 0 0 1\nEQUIV 0 1\nVERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1 0 0\n"
      "EDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\nEQUIV 1 0\nODD\n");
  REQUIRE(graph.skipped.size() == 2);
  CHECK(graph.skipped[0].tag == "EQUIV");
  CHECK(graph.skipped[0].lines == 2);
  CHECK(graph.skipped[0].first_line == 2);
  CHECK(graph.factor_lines == std::vector<int>{5});
}

TEST_CASE("A part that nothing ties to the first pose is found", "[graph_file]") {
  const std::string two = "VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1 0 0\nVERTEX_XY 2 1 1\n";
  const std::string motion = "EDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\n";
  const std::string seen = "EDGE_SE2_XY 0 2 1 1 1 0 1\n";
  CHECK_FALSE(find_untied(require_graph(two + motion + seen)));
  CHECK(find_untied(require_graph(two + motion))->what.find("vertex 2: no edges") == 0);
  const auto by_point = find_untied(require_graph(two + seen + "EDGE_SE2_XY 1 2 0 1 1 0 1\n"));
  REQUIRE(by_point);
  CHECK(by_point->line == 5);
  CHECK(by_point->what == "vertex 1: only points tie it to the other poses");
}

TEST_CASE("The standard graphs are whole", "[graph_file][recorded]") {
  for (const char* folder : {"pose_graphs", "victoria_park_landmark"}) {
    for (const auto& entry : std::filesystem::directory_iterator(test::recording(folder))) {
      const std::string name = entry.path().filename().string();
      if (name.find("README") == 0 || entry.path().extension() == ".csv") continue;
      std::ifstream in(entry.path());
      const std::string text((std::istreambuf_iterator<char>(in)), {});
      INFO(name);
      const auto graph = require_graph(text);
      CHECK_FALSE(find_untied(graph));
      CHECK(graph.skipped.size() == (name == "w100.graph" ? 1 : 0));
    }
  }
}

TEST_CASE("An edge from a vertex to itself is left out, and reported", "[graph_file]") {
  const factor_graph::files::GraphFile graph = require_graph(
      "VERTEX_SE2 3 0 0 0\nVERTEX_SE2 5 1 0 0\nEDGE_SE2 5 5 0 0 0 1 0 0 1 0 1\n"
      "EDGE_SE2 3 5 1 0 0 1 0 0 1 0 1\n");
  REQUIRE(graph.factors.size() == 1);
  REQUIRE(graph.vertices.size() == 2);
  REQUIRE(graph.self_edges == std::vector<int>{3});
}

TEST_CASE("What is written reads back as the same graph", "[graph_file]") {
  const std::string text =
      "VERTEX_SE2 3 0.1 0.2 0.3\nVERTEX_SE2 5 1.1 0.2 -3.1\nVERTEX_XY 9 4 5\n"
      "VERTEX_SE3:QUAT 10 1 2 3 0.5 0.5 0.5 0.5\nVERTEX_SE3:QUAT 11 1 2 4 0 0 0 1\n"
      "EDGE_SE2 3 5 1 0.1 0.2 10 1 2 20 3 30\nEDGE_SE2_XY 5 9 2 3 4 0.5 5\n"
      "EDGE_SE3:QUAT 10 11 0.1 0.2 0.3 0.5 0.5 0.5 0.5 "
      "10 0 0 0 0 1 10 0 0 0 0 10 0 0 0 40 0 0 40 0 40\n";
  factor_graph::graph::FactorGraph graph;
  fill(graph, require_graph(text));
  int skipped = 0;
  const std::string written = factor_graph::files::write_g2o(graph, &skipped);
  REQUIRE(skipped == 1);
  factor_graph::graph::FactorGraph again;
  fill(again, require_graph(written));
  REQUIRE(factor_graph::files::write_g2o(again) == written);
  REQUIRE(again.chi2() == Approx(graph.chi2()).epsilon(1e-12));
}

TEST_CASE("A g2o file has the digits that are asked for, and no line for what it has no tag for",
          "[graph_file]") {
  using factor_graph::files::G2oWriter;
  using factor_graph::graph::FactorKind;
  using factor_graph::graph::VariableType;
  const std::array<double, 3> pose{1.0 / 3.0, 2e9, -0.5};
  const std::array<double, 2> point{1.0 / 3.0, 4.0};
  const std::array<std::uint64_t, 2> ends{7, 8};
  const Eigen::Matrix2d information{{1.0 / 3.0, 0.25}, {0.25, 100.0}};

  G2oWriter nine(9);
  CHECK(nine.vertex(VariableType::kPose2, 7, pose));
  CHECK(nine.vertex(VariableType::kPoint2, 8, point));
  nine.fix(7);
  CHECK(nine.edge(FactorKind::kPoint2, ends, point, information));
  CHECK_FALSE(nine.vertex(VariableType::kScalar, 9, point));
  CHECK_FALSE(nine.edge(FactorKind::kPriorPose2, ends, pose, information));
  CHECK(nine.take() ==
        "VERTEX_SE2 7 0.333333333 2e+09 -0.5\nVERTEX_XY 8 0.333333333 4\nFIX 7\n"
        "EDGE_SE2_XY 7 8 0.333333333 4 0.333333333 0.25 100\n");
  CHECK(nine.take().empty());

  G2oWriter all;
  all.vertex(VariableType::kPoint2, 8, point);
  CHECK(all.take() == "VERTEX_XY 8 0.3333333333333333 4\n");
}

TEST_CASE("The batch solver finds the published optima", "[graph_file][recorded]") {
  const std::pair<const char*, double> optima[] = {{"w100.graph", 1.13783},
                                                   {"g2o_intel.g2o", 546.461},
                                                   {"tinyGrid3D.g2o", 6.72788},
                                                   {"smallGrid3D.g2o", 458.154}};
  for (const auto& [name, chi2] : optima) {
    std::ifstream in(test::recording(std::filesystem::path("pose_graphs") / name));
    REQUIRE(in);
    const std::string text((std::istreambuf_iterator<char>(in)), {});
    factor_graph::graph::FactorGraph graph;
    fill(graph, require_graph(text));
    const factor_graph::batch::BatchReport report = factor_graph::batch::optimise(graph);
    INFO(name);
    REQUIRE(report.ok);
    REQUIRE(report.chi2 == Approx(chi2).epsilon(1e-4));
  }
}
