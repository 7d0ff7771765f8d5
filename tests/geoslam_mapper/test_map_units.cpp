// A map of ranges that are all too short is given out in metres.
#include <map>
#include <random>

#include "services/geoslam_mapper/smoothing/smoothing_mapper.hpp"
#include "tests/catch.hpp"
#include "tests/geoslam_mapper/simple_keyframe.hpp"

using namespace understory;
using namespace understory::geoslam_mapper::smoothing;

namespace {

/// A drive along 600 m through trunks, with a keyframe every 2 m whose ranges are all
/// (1 + range_error) times the true ones, and odometry of 0.2 %.
class ShortSighted {
 public:
  ShortSighted(double range_error, std::uint64_t seed)
      : random_(seed), range_error_(range_error), mapper_(parameters()) {
    std::uniform_real_distribution<double> along(-25.0, 625.0);
    std::uniform_real_distribution<double> across(-20.0, 20.0);
    for (int i = 0; i < 1200; ++i) trunks_.emplace_back(along(random_), across(random_));
  }

  void drive(int keyframes) {
    for (int i = 0; i < keyframes; ++i) {
      if (sequence_ > 0) mapper_.add(step());
      const model::MapUpdate update = mapper_.add(keyframe());
      placed_ += update.status != model::MapUpdateStatus::kNotSure ? 1 : 0;
      hold(update);
      ++sequence_;
    }
  }
  SmoothingMapper& mapper() { return mapper_; }
  int placed() const { return placed_; }
  /// What a subscriber that follows every change has.
  const std::map<model::LandmarkId, Eigen::Vector2d>& held() const { return held_; }
  geometry::SE2 true_pose(int sequence) const { return {2.0 * sequence, 0.0, 0.0}; }

 private:
  static geoslam_mapper::SmoothingMapperParameters parameters() {
    geoslam_mapper::SmoothingMapperParameters result;
    result.use_odometry = true;
    result.min_observations = 2;
    result.scale_sigma = 0.01;
    result.odometry_scale_sigma = 0.0;
    return result;
  }

  model::Odometry step() {
    const Eigen::Vector3d error(normal_(random_), normal_(random_), normal_(random_));
    return test::simple_odometry(sequence_, 2.0, {0.004, 0.004, 1e-3}, error);
  }

  model::Keyframe keyframe() {
    model::Keyframe result = test::simple_keyframe(sequence_, 20.0);
    for (const Eigen::Vector2d& trunk : trunks_) {
      const Eigen::Vector2d true_m = true_pose(sequence_).inverse() * trunk;
      if (true_m.norm() > 20.0) continue;
      const Eigen::Vector2d noise_m = 0.02 * Eigen::Vector2d(normal_(random_), normal_(random_));
      result.landmarks.push_back(
          test::simple_tree((1.0 + range_error_) * true_m + noise_m, 0.02, 1));
    }
    return result;
  }

  void hold(const model::MapUpdate& update) {
    for (const auto& [old_id, new_id] : update.merged) held_.erase(old_id);
    for (const model::LandmarkId id : update.removed) held_.erase(id);
    for (const model::MapLandmark& one : mapper_.take_changed_landmarks())
      held_[one.id] = one.position_m;
  }

  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  double range_error_;
  SmoothingMapper mapper_;
  std::vector<Eigen::Vector2d> trunks_;
  int sequence_ = 0;
  int placed_ = 0;
  std::map<model::LandmarkId, Eigen::Vector2d> held_;
};

}  // namespace

TEST_CASE("A map of ranges that are too short is given out in metres", "[map units]") {
  for (const double range_error : {-0.01, 0.0, 0.006}) {
    ShortSighted vehicle(range_error, 5);
    vehicle.drive(300);
    CAPTURE(range_error, vehicle.mapper().current().map_factor());
    CHECK(vehicle.placed() == 300);

    const auto poses = vehicle.mapper().trajectory();
    REQUIRE(poses.size() == 300);
    const double length_m = poses.back().map_T_vehicle.translation().norm();
    CHECK(length_m == Approx(598.0).margin(0.6));

    // Poses state what is left of the scale.
    const geometry::SE2 truth = vehicle.true_pose(299);
    const Eigen::Vector2d off = poses.back().map_T_vehicle.translation() - truth.translation();
    const Eigen::Matrix2d covariance = poses.back().covariance.topLeftCorner<2, 2>();
    CHECK(off.dot(covariance.inverse() * off) < 25.0);
  }
}

TEST_CASE("Who follows the changes has the map in metres", "[map units]") {
  ShortSighted vehicle(-0.01, 6);
  vehicle.drive(200);
  const auto landmarks = vehicle.mapper().landmarks();
  REQUIRE(landmarks.size() > 300);
  double worst_m = 0.0;
  for (const model::MapLandmark& one : landmarks) {
    const auto held = vehicle.held().find(one.id);
    REQUIRE(held != vehicle.held().end());
    worst_m = std::max(worst_m, (held->second - one.position_m).norm());
  }
  CHECK(worst_m < 0.05);
}

TEST_CASE("The scale goes on after a restart", "[map units]") {
  ShortSighted vehicle(-0.01, 7);
  vehicle.drive(120);
  const double factor = vehicle.mapper().current().map_factor();
  CHECK(factor == Approx(1.0 / 0.99).margin(1e-3));
  const std::string state = vehicle.mapper().save();
  vehicle.mapper().load(state);
  CHECK(vehicle.mapper().current().map_factor() == factor);
  vehicle.drive(30);
  CHECK(vehicle.placed() == 150);
}
