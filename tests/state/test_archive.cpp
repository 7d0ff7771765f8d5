// Saved states: the same values back, bit by bit; damage is an error and never a large allocation.
#include "common/state/archive.hpp"

#include <limits>
#include <random>

#include "common/model/archive.hpp"
#include "tests/catch.hpp"

using namespace understory;

namespace {

constexpr state::Format kFormat{"test", 3};

enum class Colour : std::uint8_t { kRed, kGreen };

/// One member of every kind that an archive knows.
struct Everything {
  bool flag = false;
  std::int64_t count = 0;
  double number = 0.0;
  Colour colour = Colour::kRed;
  std::string text;
  Eigen::Matrix<double, 2, 3> fixed = Eigen::Matrix<double, 2, 3>::Zero();
  Eigen::MatrixXd dynamic;
  Eigen::Quaterniond turned = Eigen::Quaterniond::Identity();
  geometry::SE2WithCovariance pose;
  std::optional<double> nothing = 1.0;
  std::optional<std::vector<int>> something;
  std::vector<bool> bits;
  std::deque<std::pair<int, double>> pairs;
  std::map<int, std::string> names;
  std::array<float, 3> three{};

  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.flag, s.count, s.number, s.colour, s.text, s.fixed, s.dynamic, s.turned, s.pose, s.nothing,
      s.something, s.bits, s.pairs, s.names, s.three);
  }
};

Everything filled() {
  Everything all;
  all.flag = true;
  all.count = std::numeric_limits<std::int64_t>::min();
  all.number = 0.1;
  all.colour = Colour::kGreen;
  all.text = std::string("a\0b", 3);
  all.fixed << 1, 2, 3, 4, 5, 6;
  all.dynamic = Eigen::MatrixXd::Random(3, 4);
  all.turned = Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5);
  all.pose = {geometry::SE2(1.0, -2.0, 3.0), 0.25 * Eigen::Matrix3d::Identity()};
  all.nothing.reset();
  all.something = {1, 2, 3};
  all.bits = {true, false, true};
  all.pairs = {{1, 0.5}, {2, -0.0}};
  all.names = {{7, "seven"}, {-1, ""}};
  all.three = {1.0F, 2.0F, 3.0F};
  return all;
}

}  // namespace

TEST_CASE("a state gives back every member bit by bit") {
  const Everything all = filled();
  const std::string bytes = state::save(kFormat, all);

  Everything back;
  state::load(bytes, kFormat, back);

  CHECK(back.number == all.number);
  CHECK(back.count == all.count);
  CHECK(back.text == all.text);
  CHECK(back.dynamic == all.dynamic);
  CHECK(back.pose.mean.coordinates() == all.pose.mean.coordinates());
  CHECK(!back.nothing);
  CHECK(back.something == all.something);
  CHECK(back.bits == all.bits);
  CHECK(back.names == all.names);
  // Every member, those that were not named above included.
  CHECK(state::save(kFormat, back) == bytes);
}

TEST_CASE("nothing is left of what a loaded object held before") {
  const std::string bytes = state::save(kFormat, Everything{});
  Everything back = filled();
  state::load(bytes, kFormat, back);
  CHECK(!back.something);
  CHECK(state::save(kFormat, back) == bytes);
}

TEST_CASE("a matrix may be all that is left of a state, of any shape") {
  for (Eigen::Index rows = 0; rows <= 5; ++rows) {
    for (Eigen::Index cols = 0; cols <= 5; ++cols) {
      const Eigen::MatrixXd matrix = Eigen::MatrixXd::Random(rows, cols);
      Eigen::MatrixXd back = Eigen::MatrixXd::Random(2, 2);
      state::load(state::save(kFormat, matrix), kFormat, back);
      CHECK(back.rows() == rows);
      CHECK(back.cols() == cols);
      CHECK(back == matrix);
    }
  }
}

TEST_CASE("an odometry increment survives with its preintegration") {
  model::Odometry increment;
  increment.utime = 7;
  increment.inertial.emplace().yaw_rad = 0.3;
  increment.is_stationary = true;
  const std::string bytes = state::save(kFormat, increment);

  model::Odometry back;
  state::load(bytes, kFormat, back);
  REQUIRE(back.inertial);
  CHECK(back.inertial->yaw_rad == 0.3);
  CHECK(back.is_stationary);
  CHECK(state::save(kFormat, back) == bytes);
}

TEST_CASE("a state of another format, version or length is refused") {
  const std::string bytes = state::save(kFormat, 1.0);
  double back = 0.0;
  CHECK_THROWS_AS(state::load(bytes, {"other", 3}, back), std::invalid_argument);
  CHECK_THROWS_AS(state::load(bytes, {"test", 4}, back), std::invalid_argument);
  CHECK_THROWS_AS(state::load(bytes + "x", kFormat, back), std::invalid_argument);
  CHECK_THROWS_AS(state::load("", kFormat, back), std::invalid_argument);
}

TEST_CASE("every cut of a state is refused, and no damaged byte asks for memory") {
  const std::string bytes = state::save(kFormat, filled());
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    Everything back;
    CHECK_THROWS_AS(state::load(std::string_view(bytes).substr(0, size), kFormat, back),
                    std::invalid_argument);
  }

  std::mt19937 random(1);
  for (int trial = 0; trial < 2000; ++trial) {
    std::string damaged = bytes;
    damaged[random() % damaged.size()] = static_cast<char>(random());
    Everything back;
    try {
      state::load(damaged, kFormat, back);
    } catch (const std::invalid_argument&) {
      continue;
    }
    CHECK(back.bits.size() + back.pairs.size() + back.names.size() < bytes.size());
    CHECK(static_cast<std::size_t>(back.dynamic.size()) < bytes.size());
  }
}
