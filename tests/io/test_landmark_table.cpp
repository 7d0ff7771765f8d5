// Tables of surveyed landmarks.
#include "common/io/data_error.hpp"
#include "common/io/landmark_table.hpp"
#include "tests/catch.hpp"

using namespace understory;
using Catch::Matchers::Contains;

namespace {

std::vector<io::LandmarkRow> parse(const std::string& text) {
  return io::parse_landmark_table(text, "stems.csv", {0.2, {}}).rows;
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
           {"1,2\n3,4\n", "line 1", "no column for x"},
           {"x_m,northig\n1,2\n", "line 1", "nearest is 'northig' (--columns 'y=northig')"},
           {"x,y,dbh\n1,2,30\n", "line 1", "column 'dbh' has no unit"},
           {"x,y,dbh [yd]\n1,2,3\n", "line 1", "the unit 'yd' is none of m, cm, mm, in, ft"},
           {"lon,lat\n8.1,50.2\n", "line 1", "column 'lon' is in degrees"},
           {"x,y\n1,5,2\n", "line 2", "3 cells"},
           {"x;y\n1.234,5;2\n", "line 2", "x_m '1.234,5' is no finite number"},
           {"\xFF\xFEx", "stems.csv: ", "UTF-16"},
           {"x_m,x_m\n1,2\n", "line 1", "comes twice"},
           {"x_m,dbh_m\n1,2\n", "line 1", "no column for y"},
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

TEST_CASE("tables of surveyors are read as they write them", "[io]") {
  const std::string rows = "\n17;\"Eiche; alt\";401234,567;5654321,001;42,5\n";
  for (const std::string& heading : {std::string("Nr;Baumart;Rechtswert;Hochwert;BHD [cm]"),
                                     std::string("id;species;Easting;NORTHING;dbh_cm"),
                                     std::string("id;species;utm east;utm_north;Diameter (cm)"),
                                     std::string("id;species;X [m];Y (m);dbh cm")}) {
    CAPTURE(heading);
    const auto read = io::parse_landmark_table(heading + rows, "stems.csv", {0.2, {}});
    REQUIRE(read.rows.size() == 1);
    const model::MapLandmark& one = read.rows.front().landmark;
    CHECK(one.position_m == Eigen::Vector2d(401234.567, 5654321.001));
    CHECK(one.radius_m == Approx(0.2125));
    CHECK(read.passed_over.size() == 2);
  }

  const auto tabs = parse("x\ty\tsigma_mm\n1,5\t-2.25\t50\n");
  CHECK(tabs.front().landmark.position_m == Eigen::Vector2d(1.5, -2.25));
  CHECK(tabs.front().landmark.covariance_m2(0, 0) == Approx(0.0025));
}

TEST_CASE("a person says which column is what", "[io]") {
  const auto named = io::parse_named_columns("x=position east,y=b,dbh_mm=D");
  const std::string text = "position east,b,D,x,dbh_m\n1,2,300,7,8\n";
  const auto read = io::parse_landmark_table(text, "stems.csv", {0.2, named});
  CHECK(read.rows.front().landmark.position_m == Eigen::Vector2d(1.0, 2.0));
  CHECK(read.rows.front().landmark.radius_m == Approx(0.15));
  CHECK(read.passed_over == std::vector<std::string>{"x", "dbh_m"});

  CHECK_THROWS_WITH(io::parse_landmark_table("x,y\n1,2\n", "stems.csv", {0.2, named}),
                    Contains("line 1") && Contains("no column 'position east' (--columns)"));
  for (const char* wrong : {"x", "x=", "=a", "height_m=h", "x=a,,y=b"})
    CHECK_THROWS_AS(io::parse_named_columns(wrong), std::invalid_argument);
  CHECK(io::parse_named_columns("").empty());
  for (const auto& [columns, what] : std::vector<std::pair<std::string, std::string>>{
           {"dbh_cm=D [mm]", "the heading says mm"}, {"x=x,y=x", "'x' is named twice"}})
    CHECK_THROWS_WITH(io::parse_landmark_table("x,y,D [mm]\n1,2,3\n", "s.csv",
                                               {0.2, io::parse_named_columns(columns)}),
                      Contains(what));
  const auto by_heading = io::parse_landmark_table("x,y,D [mm]\n1,2,300\n", "s.csv",
                                                   {0.2, io::parse_named_columns("dbh=D [mm]")});
  CHECK(by_heading.rows.front().landmark.radius_m == Approx(0.15));
  const auto unitless = io::parse_named_columns("dbh=D");
  CHECK_THROWS_WITH(io::parse_landmark_table("x,y,D\n1,2,3\n", "s.csv", {0.2, unitless}),
                    Contains("has no unit"));
}
