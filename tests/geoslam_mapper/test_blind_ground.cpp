// Known ground on which nothing is detected: the path there hangs on odometry alone.
#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <random>

#include "services/geoslam_mapper/smoothing/smoothing_mapper.hpp"
#include "tests/catch.hpp"
#include "tests/geoslam_mapper/simple_keyframe.hpp"

using namespace understory;
using namespace understory::geoslam_mapper;
using namespace understory::geoslam_mapper::smoothing;

namespace {

constexpr int kLap = 120;  ///< Keyframes of a lap, 2 m apart.
constexpr int kBlindFrom = kLap + 20;
constexpr int kBlindTo = kLap + 95;
constexpr double kStepM = 2.0;
constexpr double kRangeM = 15.0;
constexpr double kSigmaM = 0.05;

/// Two laps and a bit round a ring among trees; on most of the second lap no tree is detected.
class BlindLap {
 public:
  explicit BlindLap(std::uint64_t seed) : random_(seed) {
    std::uniform_real_distribution<double> across(-60.0, 60.0);
    for (int i = 0; i < 260; ++i) trees_m_.emplace_back(across(random_), 40.0 + across(random_));
    for (int i = 0; i < 2 * kLap + 20; ++i) truth_.push_back(pose_at(i));
  }
  const std::vector<geometry::SE2>& truth() const { return truth_; }

  model::Odometry odometry(int i) {
    const auto k = static_cast<std::size_t>(i);
    const Eigen::Vector3d sigma(0.02, 0.02, 5e-3);
    model::Odometry motion;
    motion.sequence = k;
    motion.from_utime = test::utime_of(i);
    motion.utime = test::utime_of(i + 1);
    motion.from_T_to =
        truth_[k].inverse() * truth_[k + 1] *
        geometry::SE2::Exp({sigma.x() * draw(), sigma.y() * draw(), sigma.z() * draw()});
    motion.covariance = sigma.array().square().matrix().asDiagonal();
    motion.has_wheels = true;
    return motion;
  }

  model::Keyframe keyframe(int i) {
    model::Keyframe keyframe = test::simple_keyframe(i, kRangeM);
    if (i >= kBlindFrom && i < kBlindTo) return keyframe;
    for (const Eigen::Vector2d& tree_m : trees_m_) {
      const Eigen::Vector2d seen_m = truth_[static_cast<std::size_t>(i)].inverse() * tree_m;
      if (seen_m.norm() > kRangeM) continue;
      keyframe.landmarks.push_back(
          test::simple_tree(seen_m + kSigmaM * Eigen::Vector2d(draw(), draw()), kSigmaM, 1));
    }
    return keyframe;
  }

 private:
  /// Each lap a little beside the last one; a base is at the origin first.
  static geometry::SE2 pose_at(int i) {
    const double radius_m = kLap * kStepM / (2.0 * std::numbers::pi) + 0.01 * (i / kLap);
    const double angle = 2.0 * std::numbers::pi * i / kLap;
    return {radius_m * std::sin(angle), radius_m * (1.0 - std::cos(angle)), angle};
  }
  double draw() { return normal_(random_); }

  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  std::vector<Eigen::Vector2d> trees_m_;
  std::vector<geometry::SE2> truth_;
};

struct BlindErrors {
  double squared_m2 = 0.0;
  double nees = 0.0;
  int poses = 0;

  double rms_m() const { return std::sqrt(squared_m2 / poses); }
  double mean_nees() const { return nees / poses; }
};

/// Of the keyframes that saw nothing, as the map has them when the vehicle is back.
void drive(std::uint64_t seed, bool bounded, BlindErrors& errors) {
  BlindLap lap(seed);
  SmoothingMapperParameters parameters;
  parameters.use_odometry = true;
  parameters.condense_m = 0.0;
  if (!bounded) parameters.known_ground_m = parameters.fold_distance_m = 0.0;
  SmoothingMapper mapper(parameters);
  for (int i = 0; i < static_cast<int>(lap.truth().size()); ++i) {
    if (i > 0) mapper.add(lap.odometry(i - 1));
    const model::MapUpdate update = mapper.add(lap.keyframe(i));
    const bool is_taken = update.status == model::MapUpdateStatus::kUpdated ||
                          update.status == model::MapUpdateStatus::kFirstMap;
    INFO("keyframe " << i << ": " << update.reason);
    REQUIRE(is_taken);
  }

  for (const model::KeyframePose& pose : mapper.trajectory()) {
    const auto i = static_cast<int>(pose.keyframe_sequence);
    if (i < kBlindFrom + 5 || i >= kBlindTo - 5) continue;
    const Eigen::Vector3d error =
        (pose.map_T_vehicle.inverse() * lap.truth()[static_cast<std::size_t>(i)]).Log();
    errors.squared_m2 += error.head<2>().squaredNorm();
    errors.nees += error.dot(pose.covariance.inverse() * error);
    ++errors.poses;
  }
}

}  // namespace

TEST_CASE("Where nothing is detected on known ground odometry still ties the path", "[mapper]") {
  BlindErrors bounded;
  BlindErrors whole;
  for (const std::uint64_t seed : {1, 2, 3, 4, 5, 6, 7, 8}) {
    drive(seed, true, bounded);
    drive(seed, false, whole);
  }
  CHECK(bounded.rms_m() < 1.1 * whole.rms_m());
  CHECK(bounded.mean_nees() < 5.0);
  CHECK(whole.mean_nees() < 5.0);
  CAPTURE(bounded.rms_m(), whole.rms_m(), bounded.mean_nees(), whole.mean_nees());
  CHECK(whole.rms_m() > 0.1);  // Odometry alone drifts there.
}
