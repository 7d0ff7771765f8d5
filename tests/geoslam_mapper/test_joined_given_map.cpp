// A given map has no path: behind a gap where odometry alone led on it is met again, whether the
// drive began in it or found it from a map begun beside it.
#include <algorithm>
#include <random>
#include <vector>

#include "services/geoslam_mapper/smoothing/smoothing_mapper.hpp"
#include "tests/catch.hpp"
#include "tests/geoslam_mapper/simple_keyframe.hpp"

using namespace understory;
using namespace understory::geoslam_mapper;
using namespace understory::geoslam_mapper::smoothing;

namespace {

constexpr double kStep_m = 2.0;
constexpr double kRange_m = 20.0;
constexpr double kSigma_m = 0.05;
constexpr double kUnknown_m = 60.0;  ///< The given map begins here,
constexpr double kGap_m = 160.0;     ///< here trees end,
constexpr double kBehind_m = 260.0;  ///< and go on.
constexpr double kEnd_m = 340.0;
constexpr int kKeyframes = static_cast<int>(kEnd_m / kStep_m);

/// Straight on among trees that are at least 3 m apart.
class Road {
 public:
  explicit Road(std::uint64_t seed) : random_(seed) {
    std::uniform_real_distribution<double> along(-kRange_m, kEnd_m + kRange_m);
    std::uniform_real_distribution<double> across(-15.0, 15.0);
    while (trees_m_.size() < 150) {
      const Eigen::Vector2d tree_m(along(random_), across(random_));
      const bool is_near = std::ranges::any_of(
          trees_m_, [&](const Eigen::Vector2d& other) { return (other - tree_m).norm() < 3.0; });
      if (!is_near && (tree_m.x() < kGap_m || tree_m.x() > kBehind_m)) trees_m_.push_back(tree_m);
    }
  }

  std::vector<model::MapLandmark> given(double from_m) {
    std::vector<model::MapLandmark> result;
    for (const Eigen::Vector2d& tree_m : trees_m_) {
      if (tree_m.x() < from_m) continue;
      model::MapLandmark one;
      one.id = (std::uint64_t{7} << 48U) + result.size() + 1;
      one.position_m = tree_m + 0.02 * Eigen::Vector2d(draw(), draw());
      one.covariance_m2 = 4e-4 * Eigen::Matrix2d::Identity();
      one.radius_m = 0.2;
      result.push_back(one);
    }
    return result;
  }
  model::Odometry odometry(int i) {
    return test::simple_odometry(i, kStep_m, {0.02, 0.01, 3e-3}, {draw(), draw(), draw()});
  }
  model::Keyframe keyframe(int i) {
    model::Keyframe keyframe = test::simple_keyframe(i, kRange_m);
    for (const Eigen::Vector2d& tree_m : trees_m_) {
      const Eigen::Vector2d seen_m = tree_m - Eigen::Vector2d(kStep_m * i, 0.0);
      if (seen_m.norm() > kRange_m) continue;
      keyframe.landmarks.push_back(
          test::simple_tree(seen_m + kSigma_m * Eigen::Vector2d(draw(), draw()), kSigma_m));
    }
    return keyframe;
  }
  static Eigen::Vector2d position_m(int i) { return {kStep_m * i, 0.0}; }
  std::size_t size() const { return trees_m_.size(); }

 private:
  double draw() { return normal_(random_); }

  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  std::vector<Eigen::Vector2d> trees_m_;
};

SmoothingMapperParameters with_odometry() {
  SmoothingMapperParameters parameters;
  parameters.use_odometry = true;
  parameters.gyro_walk = 0.0;
  return parameters;
}

}  // namespace

TEST_CASE("Behind a gap the map that a drive began in is met again, and not doubled",
          "[given_map]") {
  std::size_t doubles = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    CAPTURE(seed);
    Road road(seed);
    SmoothingMapper mapper(with_odometry());
    mapper.start_with(road.given(-kRange_m));
    model::MapUpdate last;
    for (int i = 0; i < kKeyframes; ++i) {
      if (i > 0) mapper.add(road.odometry(i));
      last = mapper.add(road.keyframe(i));
    }
    doubles += mapper.landmarks().size() - road.size();
    CHECK((last.map_T_vehicle.translation() - Road::position_m(kKeyframes - 1)).norm() < 0.1);
  }
  CHECK(doubles <= 3);  // Of 3,000 trees.
}

TEST_CASE("Behind a gap a given map that was joined is met again, and not doubled", "[rejoining]") {
  int joined = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    CAPTURE(seed);
    Road road(seed);
    SmoothingMapper mapper(with_odometry());
    mapper.start_with(road.given(kUnknown_m));
    bool was_kept = false;
    for (int i = 0; i < kKeyframes; ++i) {
      if (i > 0) mapper.add(road.odometry(i));
      (void)mapper.add(road.keyframe(i));
      was_kept = was_kept || !mapper.kept_maps().maps().empty();
    }
    REQUIRE(was_kept);
    if (!mapper.kept_maps().maps().empty()) continue;
    ++joined;
    CHECK(mapper.landmarks().size() <= road.size() + 3);
  }
  CHECK(joined >= 8);
}
