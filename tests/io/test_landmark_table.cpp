// Tables of surveyed landmarks.
#include "common/io/data_error.hpp"
#include "common/io/landmark_table.hpp"
#include "tests/catch.hpp"

using namespace understory;
using Catch::Matchers::Contains;

namespace {

std::vector<io::LandmarkRow> parse(const std::string& text) {
  return io::parse_landmark_table(text, "stems.csv", 0.2);
}

}  // namespace

TEST_CASE("columns come in any order, and may be left out", "[io]") {
  const auto rows = parse(
      "\xEF\xBB\xBFkind, dbh_m,\"y_m\",x_m,sigma_m\r\n# a remark\r\n\r\ncorner,,2,1,0.5\r\n"
      "trunk,0.3,-4e1,3.5,\r\n,,0,0,1");
  REQUIRE(rows.size() == 3);
  CHECK(rows[0].landmark.position_m == Eigen::Vector2d(1.0, 2.0));
  CHECK(rows[0].landmark.covariance_m2 == 0.25 * Eigen::Matrix2d::Identity());
  CHECK(rows[0].landmark.kind == model::LandmarkKind::kCorner);
  CHECK(rows[0].landmark.radius_m == 0.0);
  CHECK(rows[0].line == 4);
  CHECK(rows[1].landmark.position_m == Eigen::Vector2d(3.5, -40.0));
  CHECK(rows[1].landmark.covariance_m2(0, 0) == Approx(0.04));
  CHECK(rows[1].landmark.radius_m == 0.15);
  CHECK(rows[2].landmark.kind == model::LandmarkKind::kTrunk);
}

TEST_CASE("what is no table of landmarks is refused with its line", "[io]") {
  struct Wrong {
    std::string text, line, what;
  };
  for (const Wrong& one : std::vector<Wrong>{
           {"", "stems.csv: ", "no heading"},
           {"\n\n", "stems.csv: ", "no heading"},
           {"x_m,y_m\n", "stems.csv: ", "no landmark"},
           {"1,2\n3,4\n", "line 1", "unknown column '1'"},
           {"x_m,y_m,height_m\n1,2,3\n", "line 1", "unknown column 'height_m'"},
           {"x_m,x_m\n1,2\n", "line 1", "comes twice"},
           {"x_m,dbh_m\n1,2\n", "line 1", "no column y_m"},
           {"x_m,y_m\n1\n", "line 2", "1 cells, the heading has 2"},
           {"x_m,y_m\n1,2,3\n", "line 2", "3 cells"},
           {"x_m,y_m\n1,2\n1,two\n", "line 3", "y_m 'two'"},
           {"x_m,y_m\n1,\n", "line 2", "y_m ''"},
           {"x_m,y_m\n1,nan\n", "line 2", "no finite number"},
           {"x_m,y_m\n1,inf\n", "line 2", "no finite number"},
           {"x_m,y_m\n1e300,2\n", "line 2", "1e8 m"},
           {"x_m,y_m\n1e999,2\n", "line 2", "no finite number"},
           {"x_m,y_m\n1,2\n300000,2\n", "line 3", "200 km"},
           {"x_m,y_m,sigma_m\n1,2,0\n", "line 2", "sigma_m is 0"},
           {"x_m,y_m,sigma_m\n1,2,-1\n", "line 2", "sigma_m -1"},
           {"x_m,y_m,sigma_m\n1,2,1e300\n", "line 2", "sigma_m 1e+300"},
           {"x_m,y_m,dbh_m\n1,2,-0.1\n", "line 2", "dbh_m -0.1"},
           {"x_m,y_m,dbh_m\n1,2,21\n", "line 2", "within 0 and 20 m"},
           {"x_m,y_m,kind\n1,2,house\n", "line 2", "kind 'house' is neither trunk nor corner"}}) {
    CAPTURE(one.text);
    CHECK_THROWS_WITH(parse(one.text), Contains(one.line) && Contains(one.what));
    CHECK_THROWS_AS(parse(one.text), io::DataError);
  }
}

TEST_CASE("pairs that stand close together are found", "[io]") {
  const auto rows = parse("x_m,y_m\n0,0\n10,0\n0.05,0\n10,0.2\n10,0.1\n");
  const auto pairs = io::close_pairs(rows, 0.15);
  REQUIRE(pairs.size() == 3);
  CHECK(pairs[0].first == 0);
  CHECK(pairs[0].second == 2);
  CHECK(pairs[0].distance_m == Approx(0.05));
  CHECK(pairs[1].second == 4);
  CHECK(pairs[2].first == 3);
  CHECK(io::close_pairs(rows, 0.01).empty());
  CHECK(io::close_pairs(rows, 0.0).empty());
}
