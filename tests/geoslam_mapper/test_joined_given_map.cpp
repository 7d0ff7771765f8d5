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

/// Straight on among trees.
class Road {
 public:
  explicit Road(std::uint64_t seed, std::size_t trees = 150, double apart_m = 3.0,
                double edge_m = 0.0)
      : random_(seed) {
    std::uniform_real_distribution<double> along(-kRange_m, kEnd_m + kRange_m);
    std::uniform_real_distribution<double> across(-15.0, 15.0);
    while (trees_m_.size() < trees) {
      const Eigen::Vector2d tree_m(along(random_), across(random_));
      const bool is_near = std::ranges::any_of(trees_m_, [&](const Eigen::Vector2d& other) {
        return (other - tree_m).norm() < apart_m;
      });
      const bool is_wood = tree_m.x() < kGap_m || tree_m.x() > kBehind_m + edge_m;
      if (!is_near && is_wood) trees_m_.push_back(tree_m);
    }
  }

  /// Of the trees from there on, this share.
  std::vector<model::MapLandmark> given(double from_m, double share = 1.0) {
    std::vector<model::MapLandmark> result;
    for (const Eigen::Vector2d& tree_m : trees_m_) {
      if (tree_m.x() < from_m || (share < 1.0 && uniform_(random_) >= share)) continue;
      model::MapLandmark one;
      one.id = (std::uint64_t{7} << 48U) + result.size() + 1;
      one.position_m = tree_m + 0.02 * Eigen::Vector2d(draw(), draw());
      one.covariance_m2 = 4e-4 * Eigen::Matrix2d::Identity();
      one.radius_m = 0.2;
      result.push_back(one);
    }
    return result;
  }
  model::Odometry odometry(int i, double heading_sigma_rad = 3e-3) {
    return test::simple_odometry(i, kStep_m, {0.02, 0.01, heading_sigma_rad},
                                 {draw(), draw(), draw()});
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
  void plant(const Eigen::Vector2d& tree_m) { trees_m_.push_back(tree_m); }
  static Eigen::Vector2d position_m(int i) { return {kStep_m * i, 0.0}; }
  std::size_t size() const { return trees_m_.size(); }

 private:
  double draw() { return normal_(random_); }

  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  std::uniform_real_distribution<double> uniform_{0.0, 1.0};
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

TEST_CASE("Behind a gap one tree beside those of the given map does not tie the drive to them",
          "[given_map]") {
  // The map has a clump of trees at the edge. They were felled, and one stands between them.
  const Eigen::Vector2d clump_m(kBehind_m + 5.0, 5.0);
  std::size_t landmarks = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    CAPTURE(seed);
    Road road(seed, 400, 1.0, 40.0);
    std::vector<model::MapLandmark> given = road.given(-kRange_m);
    for (int i = 0; i < 49; ++i) {
      model::MapLandmark felled = given.back();
      ++felled.id;
      felled.position_m = clump_m + 0.4 * Eigen::Vector2d(i % 7 - 3, i / 7 - 3);
      given.push_back(felled);
    }
    for (model::MapLandmark& one : given) one.covariance_m2 = 2.5e-3 * Eigen::Matrix2d::Identity();
    road.plant(clump_m + Eigen::Vector2d(0.2, 0.2));

    SmoothingMapper mapper(with_odometry());
    mapper.start_with(given);
    model::MapUpdate last;
    for (int i = 0; i < kKeyframes; ++i) {
      if (i > 0) mapper.add(road.odometry(i, 1e-3));
      last = mapper.add(road.keyframe(i));
    }
    const Eigen::Vector2d end_m = last.map_T_vehicle.translation();
    CHECK((end_m - Road::position_m(kKeyframes - 1)).norm() < 0.1);
    landmarks += mapper.landmarks().size() - given.size();
  }
  CHECK(landmarks <= 80);  // One in each drive is new.
}

TEST_CASE("Behind a gap a map that stays as it is is met again", "[given_map]") {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    CAPTURE(seed);
    Road road(seed, 300);
    std::vector<model::MapLandmark> given = road.given(-kRange_m);
    for (model::MapLandmark& one : given) one.covariance_m2 = 2.5e-3 * Eigen::Matrix2d::Identity();
    SmoothingMapperParameters parameters = with_odometry();
    parameters.localisation_only = true;
    SmoothingMapper mapper(parameters);
    mapper.start_with(given);
    model::MapUpdate last;
    for (int i = 0; i < kKeyframes; ++i) {
      if (i > 0) mapper.add(road.odometry(i));
      last = mapper.add(road.keyframe(i));
    }
    CHECK(last.associations.size() > 10);
    CHECK((last.map_T_vehicle.translation() - Road::position_m(kKeyframes - 1)).norm() < 0.1);
  }
}

TEST_CASE("A drive in a given map is found again behind a stretch without odometry",
          "[given_map]") {
  constexpr int kLast = 40;
  constexpr int kNext = 140;  // 200 m on
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    CAPTURE(seed);
    Road road(seed, 300);
    std::vector<model::MapLandmark> given = road.given(-kRange_m);
    for (model::MapLandmark& one : given) one.covariance_m2 = 2.5e-3 * Eigen::Matrix2d::Identity();
    SmoothingMapper mapper(with_odometry());
    mapper.start_with(given);
    std::uint32_t map_id = 0;
    for (int i = 0; i <= kLast; ++i) {
      if (i > 0) mapper.add(road.odometry(i));
      map_id = mapper.add(road.keyframe(i)).map_id;
    }
    for (int i = kNext; i < kNext + 5; ++i) {
      if (i > kNext) mapper.add(road.odometry(i));
      const model::MapUpdate update = mapper.add(road.keyframe(i));
      CHECK(update.status == model::MapUpdateStatus::kUpdated);
      CHECK(update.map_id == map_id);
      CHECK((update.map_T_vehicle.translation() - Road::position_m(i)).norm() < 0.1);
    }
  }
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
