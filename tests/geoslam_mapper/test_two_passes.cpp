// Two passes by one place, off from each other by an unknown way: what one saw is where the other
// one's landmarks seem to be.
#include <algorithm>
#include <random>
#include <set>

#include "services/geoslam_mapper/smoothing/one_map.hpp"
#include "tests/catch.hpp"
#include "tests/geoslam_mapper/simple_keyframe.hpp"

using namespace understory;
using namespace understory::geoslam_mapper;
using namespace understory::geoslam_mapper::smoothing;

namespace {

constexpr int kPass = 50;   // keyframes of the first pass
constexpr int kAgain = 20;  // and of the second
constexpr double kStep_m = 2.0;
constexpr double kRange_m = 20.0;
constexpr double kSigma_m = 0.05;
constexpr double kApart_m = 30.0;  // 1 sigma of the way between the passes

/// Trees of one pass along the same stretch of the map; those of the other are really elsewhere.
class TwoPasses {
 public:
  explicit TwoPasses(std::uint64_t seed) : random_(seed) {
    std::uniform_real_distribution<double> along(-kRange_m, kStep_m * kPass + kRange_m);
    std::uniform_real_distribution<double> across(-15.0, 15.0);
    for (auto& trees_m : trees_m_)
      for (int i = 0; i < 60; ++i) trees_m.emplace_back(along(random_), across(random_));
  }

  static geometry::SE2 pose(int i) { return {kStep_m * (i % kPass), 0.0, 0.0}; }

  /// Every few keyframes of the second pass odometry knows next to nothing.
  static bool is_searched(int i) { return i > kPass + 4 && i % 4 == 0; }

  /// Back to the beginning between the passes, but for all that is known somewhere else.
  static model::Odometry odometry(int i) {
    Eigen::Vector3d sigma(0.02, 0.01, 2e-3);
    if (i == kPass) sigma << kApart_m, kApart_m, 0.2;
    if (is_searched(i)) sigma << 5.0, 5.0, 0.3;
    model::Odometry motion;
    motion.sequence = static_cast<std::uint64_t>(i);
    motion.from_utime = test::utime_of(i - 1);
    motion.utime = test::utime_of(i);
    motion.from_T_to = pose(i - 1).inverse() * pose(i);
    motion.covariance = sigma.array().square().matrix().asDiagonal();
    motion.has_wheels = true;
    return motion;
  }

  model::Keyframe keyframe(int i) {
    model::Keyframe keyframe = test::simple_keyframe(i, kRange_m);
    for (const Eigen::Vector2d& tree_m : trees_m_[i < kPass ? 0 : 1]) {
      const Eigen::Vector2d seen_m = pose(i).inverse() * tree_m;
      if (seen_m.norm() > kRange_m) continue;
      keyframe.landmarks.push_back(test::simple_tree(
          seen_m + kSigma_m * Eigen::Vector2d(normal_(random_), normal_(random_)), kSigma_m));
    }
    return keyframe;
  }

 private:
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  std::vector<Eigen::Vector2d> trees_m_[2];
};

}  // namespace

TEST_CASE("A vehicle found again among what it saw just now is tied to nothing of an earlier pass",
          "[mapper]") {
  int found = 0;
  for (std::uint64_t seed = 500; seed < 520; ++seed) {
    CAPTURE(seed);
    TwoPasses world(seed);
    SmoothingMapperParameters parameters;
    parameters.use_odometry = true;
    parameters.gyro_walk = 0.0;
    parameters.lost_sigma_m = parameters.lost_sigma_rad = 1e9;
    OneMap map(parameters);
    std::set<model::LandmarkId> earlier;

    for (int i = 0; i < kPass + kAgain; ++i) {
      if (i > 0) map.add(TwoPasses::odometry(i));
      const model::MapUpdate update = map.add(world.keyframe(i));
      if (i < kPass) earlier.insert(update.added.begin(), update.added.end());
      if (i < kPass || update.status != model::MapUpdateStatus::kUpdated) continue;
      found += TwoPasses::is_searched(i) && !update.used_prior ? 1 : 0;
      CAPTURE(i);
      CHECK(std::ranges::none_of(update.associations, [&](const model::Association& pair) {
        return earlier.contains(pair.landmark_id);
      }));
      CHECK(update.covariance(0, 0) > 0.5 * kApart_m * kApart_m);
    }
  }
  CHECK(found > 20);
}
