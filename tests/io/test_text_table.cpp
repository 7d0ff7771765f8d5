// Tables of text as spreadsheets write them.
#include <fmt/format.h>

#include <algorithm>
#include <random>

#include "common/io/data_error.hpp"
#include "common/io/landmark_table.hpp"
#include "common/io/text_table.hpp"
#include "tests/catch.hpp"

using namespace understory;
using Catch::Matchers::Contains;

namespace {

using Cells = std::vector<std::string>;

/// Letters, and what has a meaning in a table.
std::string random_cell(std::mt19937_64& random) {
  static const std::string kLetters = "ab7.,;\t\"\n#=-";
  std::string cell;
  for (std::size_t i = random() % 6; i > 0; --i) cell += kLetters[random() % kLetters.size()];
  // Blanks around a cell are not kept.
  cell.erase(0, cell.find_first_not_of(" \t"));
  while (!cell.empty() && (cell.back() == '\t' || cell.back() == ' ')) cell.pop_back();
  return cell;
}

std::string quoted(const std::string& cell) {
  std::string text = "\"";
  for (const char one : cell) text += one == '"' ? "\"\"" : std::string(1, one);
  return text + '"';
}

/// As RFC 4180 has it: between quotation marks where that is needed, and sometimes where not.
std::string written(const std::string& cell, std::mt19937_64& random) {
  const bool is_plain =
      cell.find_first_of(",;\t\"\n\r#") == std::string::npos && !cell.empty() && random() % 4 != 0;
  return is_plain ? cell : quoted(cell);
}

std::uint64_t line_ends(const std::string& text) {
  return static_cast<std::uint64_t>(std::ranges::count(text, '\n'));
}

}  // namespace

TEST_CASE("what is written between quotation marks comes back", "[io]") {
  std::mt19937_64 random(51);
  for (int trial = 0; trial < 400; ++trial) {
    const char delimiter = ",;\t"[trial % 3];
    const std::string end = std::vector<std::string>{"\n", "\r\n", "\r"}[random() % 3];
    const std::size_t columns = 2 + random() % 4;
    std::string text = random() % 2 == 0 ? "\xEF\xBB\xBF" : "";
    std::uint64_t line = 1;
    if (random() % 2 == 0) {
      text += fmt::format("sep={}{}", delimiter, end);
      ++line;
    }

    std::vector<io::TextRow> rows;
    for (std::size_t i = 0; i < 1 + random() % 6; ++i) {
      if (random() % 3 == 0) {
        text += fmt::format("{}{}", random() % 2 == 0 ? "# a remark" : "", end);
        ++line;
      }
      io::TextRow& row = rows.emplace_back(io::TextRow{line, {}});
      for (std::size_t k = 0; k < columns; ++k) {
        row.cells.push_back(i == 0 ? fmt::format("column {}", k) : random_cell(random));
        if (k > 0) text.push_back(delimiter);
        text.append(written(row.cells.back(), random));
        line += line_ends(row.cells.back());
      }
      text += end;
      ++line;
    }

    CAPTURE(text);
    const io::TextTable table = io::parse_text_table(text, "t.csv");
    CHECK(table.delimiter == delimiter);
    CHECK(table.heading.cells == rows.front().cells);
    CHECK(table.heading.line == rows.front().line);
    REQUIRE(table.rows.size() + 1 == rows.size());
    for (std::size_t i = 0; i < table.rows.size(); ++i) {
      CHECK(table.rows[i].cells == rows[i + 1].cells);
      CHECK(table.rows[i].line == rows[i + 1].line);
    }
  }
}

TEST_CASE("a quotation mark within a cell is a letter, one that opens a cell is closed", "[io]") {
  const auto table = io::parse_text_table("a,b\n5\",x\n", "t.csv");
  CHECK(table.rows.front().cells == Cells{"5\"", "x"});
  CHECK_THROWS_WITH(io::parse_text_table("a,b\n1,2\n\"3,4\n5,6\n", "t.csv"),
                    Contains("t.csv, line 3: a quotation mark is not closed"));
  CHECK_THROWS_WITH(io::parse_text_table("a,b\n\"1\n2\",3\n4\n", "t.csv"),
                    Contains("t.csv, line 4: 1 cells, the heading has 2"));
}

TEST_CASE("hostile texts end in a table or in one line", "[io]") {
  std::mt19937_64 random(52);
  static const std::string kSigns = "a1\"\"\",;\t\n\r# =";
  for (int trial = 0; trial < 5000; ++trial) {
    std::string text;
    for (std::size_t i = random() % 40; i > 0; --i) text += kSigns[random() % kSigns.size()];
    CAPTURE(text);
    try {
      const auto table = io::parse_text_table(text, "t.csv");
      for (const io::TextRow& row : table.rows)
        CHECK(row.cells.size() == table.heading.cells.size());
    } catch (const io::DataError& error) {
      CHECK_THAT(std::string(error.what()), Contains("t.csv, line ") && !Contains("\n"));
    }
  }
}

TEST_CASE("coordinates are in the units of their reference system", "[io]") {
  const auto place = [](const std::string& text, const io::CoordinateUnit& unit) {
    return io::parse_landmark_table(text, "t.csv", {0.1, {}, unit})
        .rows.front()
        .landmark.position_m;
  };
  const double foot_m = 1200.0 / 3937.0;
  CHECK(place("easting,northing\n6000000,2000000\n", {false, foot_m, true}) ==
        Eigen::Vector2d(6000000 * foot_m, 2000000 * foot_m));
  CHECK(place("x_ft,y [ft]\n10,20\n", {false, foot_m, true}) ==
        Eigen::Vector2d(10 * foot_m, 20 * foot_m));
  CHECK(place("x_m,y_m\n10,20\n", {false, foot_m, true}) == Eigen::Vector2d(10, 20));
  CHECK(place("lat,lon\n51.5,7.25\n", {true, 1.0, true}) == Eigen::Vector2d(7.25, 51.5));
  CHECK(place("Longitude [deg];Latitude [deg]\n-70,5;-33,25\n", {true, 1.0, true}) ==
        Eigen::Vector2d(-70.5, -33.25));

  const auto refused = [&](const std::string& text, const io::CoordinateUnit& unit,
                           const std::string& why) {
    CAPTURE(text);
    CHECK_THROWS_WITH(place(text, unit), Contains("t.csv, line") && Contains(why));
  };
  // Without a system they are metres' feet; a system in metres does not say which ones.
  CHECK(place("x_ft,y_feet\n10,20\n", {}) == Eigen::Vector2d(10 * 0.3048, 20 * 0.3048));
  CHECK(place("x_usft,y_usft\n10,20\n", {}) == Eigen::Vector2d(10 * foot_m, 20 * foot_m));
  refused("x_ft,y_ft\n1,2\n", {false, 1.0, true}, "the unit 'ft' is none of m, cm, mm (feet");
  refused("lat,lon\n1,2\n", {}, "is in degrees: --crs EPSG:4326");
  refused("easting,northing\n1,2\n", {true, 1.0, true}, "the reference system has degrees");
  refused("x_m,y_m\n1,2\n", {true, 1.0, true}, "the reference system has degrees");
  refused("lat_m,lon_m\n1,2\n", {true, 1.0, true}, "'m' is none of deg");
  refused("lat,lon\n7,51\n95,7\n", {true, 1.0, true}, "line 3: latitude 95 is not within");
  CHECK_THROWS_WITH(io::parse_landmark_table("a,b\n1,2\n", "t.csv",
                                             {0.1, io::parse_named_columns("lat=a,lon=b"), {}}),
                    Contains("the reference system has no degrees"));
}

TEST_CASE("lengths may be in inches and feet, and in no unit that is not known", "[io]") {
  const auto radius_m = [](const std::string& heading, const std::string& value) {
    return io::parse_landmark_table("x_m,y_m," + heading + "\n1,2," + value + "\n", "t.csv",
                                    {0.1, {}, {}})
        .rows.front()
        .landmark.radius_m;
  };
  for (const char* inches : {"dbh_in", "DBH (in)", "dbh [inch]", "Diameter inches", "dbh in"})
    CHECK(radius_m(inches, "20") == Approx(0.254));
  CHECK(radius_m("radius_ft", "1") == Approx(0.3048));
  CHECK(radius_m("BHD in cm", "50") == Approx(0.25));
  const auto sigma = io::parse_landmark_table("x_m,y_m,sigma_ft\n1,2,1\n", "t.csv", {0.1, {}, {}});
  CHECK(sigma.rows.front().landmark.covariance_m2(0, 0) == Approx(0.3048 * 0.3048));
  const auto named = io::parse_named_columns("dbh_in=D");
  CHECK(io::parse_landmark_table("x,y,D\n1,2,10\n", "t.csv", {0.1, named, {}})
            .rows.front()
            .landmark.radius_m == Approx(0.127));

  for (const char* heading : {"dbh_furlong", "dbh [furlong]"})
    CHECK_THROWS_WITH(radius_m(heading, "1"), Contains("t.csv, line 1") && Contains(heading) &&
                                                  Contains("the unit 'furlong' is none of m, cm, "
                                                           "mm, in, ft"));
  CHECK_THROWS_WITH(io::parse_landmark_table("x_yd,y_yd\n1,2\n", "t.csv", {0.1, {}, {}}),
                    Contains("'x_yd': the unit 'yd' is none of m, cm, mm, in, ft"));
  // A column beside that of the diameter may be called so, and one that is no length.
  CHECK(radius_m("dbh_cm,dbh_class", "20,3") == Approx(0.1));
  CHECK(radius_m("kind_code", "3") == 0.0);
  CHECK(radius_m("dbh_2019", "3") == 0.0);
}

TEST_CASE("radii are read, and odd diameters are told with their row and column", "[io]") {
  const auto read = io::parse_landmark_table(
      "x_m,y_m,radius_m\n1,2,0.2\n3,4,0.0015\n5,6,0\n7,8,5\n", "t.csv", {0.1, {}, {}});
  CHECK(read.rows[0].landmark.radius_m == 0.2);
  REQUIRE(read.remarks.size() == 2);
  CHECK_THAT(read.remarks[0], Contains("line 3, column 'radius_m': 0.0015 is 0.003 m of diameter"));
  CHECK_THAT(read.remarks[1], Contains("line 5") && Contains("10 m of diameter"));
  CHECK_THROWS_WITH(
      io::parse_landmark_table("x_m,y_m,radius_m,dbh_m\n1,2,0.2,0.4\n", "t.csv", {0.1, {}, {}}),
      Contains("comes twice"));
}
