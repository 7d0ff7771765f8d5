#include "eval/experiments/closures/plantation_drive.hpp"

#include <cmath>
#include <map>
#include <numbers>
#include <random>

#include "services/loop_closer/loop_closer.hpp"

namespace understory::eval::experiments::closures {
namespace {

using geometry::SE2;

constexpr double kKeyframe_m = 2.0;
constexpr double kRange_m = 18.0;
constexpr double kDetected = 0.9;
constexpr double kDetection_m = 0.03;
/// A tree that was out of sight for so many keyframes is another landmark to the mapper.
constexpr std::size_t kForgotten = 20;
/// Of the odometry between keyframes.
const Eigen::Vector3d kKeyframeSigma(0.02, 0.01, 1e-3);

/// The trees, the drive between them, and what its mapper and its loop closer say.
class PlantationMaker {
 public:
  PlantationMaker(const PlantationPlan& plan, const ClosurePlan& closures, std::uint64_t seed)
      : plan_(plan), closures_(closures), seed_(seed), random_(seed * 6'151 + 3) {}

  ClosureDrive make() {
    plant();
    drive_.truth = way();
    measure();
    look_for_loops();
    return std::move(drive_);
  }

 private:
  double normal() { return std::normal_distribution<double>()(random_); }
  double uniform() { return std::uniform_real_distribution<double>()(random_); }

  void plant() {
    const int rows = plan_.gaps * plan_.skip + 12;
    for (int row = -6; row < rows; ++row) {
      for (double x = 0.0; x <= plan_.length_m; x += plan_.trees_m) {
        if (uniform() < plan_.missing) continue;
        const double dx = plan_.sigma_m * normal(), dy = plan_.sigma_m * normal();
        trees_.emplace_back(x + dx, plan_.rows_m * (row + 0.5) + dy);
        radii_.push_back(0.12 * std::exp(0.15 * normal()));
      }
    }
  }

  /// Down one gap, round behind the last tree, up another one.
  std::vector<SE2> way() const {
    std::vector<SE2> poses;
    for (int gap = 0; gap < plan_.gaps; ++gap) {
      const bool is_down = gap % 2 == 0;
      const double y = plan_.rows_m * plan_.skip * gap;
      const double heading = is_down ? 0.0 : std::numbers::pi;
      for (double along = -4.0; along <= plan_.length_m + 4.0; along += kKeyframe_m)
        poses.emplace_back(is_down ? along : plan_.length_m - along, y, heading);
      const double x = is_down ? plan_.length_m + 6.0 : -6.0;
      for (double dy = kKeyframe_m; dy < plan_.rows_m * plan_.skip; dy += kKeyframe_m)
        poses.emplace_back(x, y + dy, 0.5 * std::numbers::pi);
    }
    const SE2 first = poses.front();
    for (SE2& pose : poses) pose = first.inverse() * pose;
    return poses;
  }

  void measure() {
    drive_.covariance = (closures_.stated * kKeyframeSigma).array().square().matrix().asDiagonal();
    const double bias =
        (uniform() < 0.5 ? -1.0 : 1.0) * closures_.yaw_bias_rad * kKeyframe_m / 10.0;
    for (std::size_t i = 0; i + 1 < drive_.truth.size(); ++i) {
      const double x = normal(), y = normal(), theta = normal();
      const Eigen::Vector3d error = kKeyframeSigma.cwiseProduct(Eigen::Vector3d(x, y, theta)) +
                                    Eigen::Vector3d(0.0, 0.0, bias);
      drive_.measured.push_back(drive_.truth[i].inverse() * drive_.truth[i + 1] * SE2::Exp(error));
    }
  }

  /// Trees in view: number and position in the vehicle's frame.
  model::Keyframe keyframe(std::size_t k, std::vector<std::size_t>& seen) {
    model::Keyframe out;
    out.utime = static_cast<model::Utime>(k + 1) * 1'000'000;
    out.sequence = k;
    out.field_of_view.max_range_m = kRange_m;
    out.members.push_back({out.utime, k, {}, Eigen::Matrix3d::Zero()});
    const SE2 vehicle_T_world = (SE2(-4.0, 0.0, 0.0) * drive_.truth[k]).inverse();
    for (std::size_t tree = 0; tree < trees_.size(); ++tree) {
      const Eigen::Vector2d at = vehicle_T_world * trees_[tree];
      if (at.norm() > kRange_m || uniform() > kDetected) continue;
      model::KeyframeLandmark landmark;
      const double x = normal(), y = normal();
      landmark.position_m = at + kDetection_m * Eigen::Vector2d(x, y);
      landmark.covariance_m2 = kDetection_m * kDetection_m * Eigen::Matrix2d::Identity();
      landmark.radius_m = radii_[tree] * std::exp(0.1 * normal());
      landmark.observation_count = 8;
      out.landmarks.push_back(landmark);
      seen.push_back(tree);
    }
    return out;
  }

  void look_for_loops() {
    loop_closer::LoopCloser closer{loop_closer::LoopCloserParameters{}};
    geometry::SE2WithCovariance pose;
    struct Known {
      model::LandmarkId id = 0;
      std::size_t seen = 0;
    };
    std::map<std::size_t, Known> known;
    model::LandmarkId newest = model::LandmarkId{1} << model::kLandmarkCounterBits;
    for (std::size_t k = 0; k < drive_.truth.size(); ++k) {
      if (k > 0) pose = compound(pose, {drive_.measured[k - 1], drive_.covariance});
      std::vector<std::size_t> seen;
      const model::Keyframe frame = keyframe(k, seen);
      model::MapUpdate update;
      update.keyframe_sequence = k;
      update.utime = frame.utime;
      update.status = k == 0 ? model::MapUpdateStatus::kFirstMap : model::MapUpdateStatus::kUpdated;
      update.map_T_vehicle = pose.mean;
      update.covariance = pose.covariance;
      for (std::size_t i = 0; i < seen.size(); ++i) {
        Known& one = known[seen[i]];
        if (one.id == 0 || k - one.seen > kForgotten) one.id = ++newest;
        one.seen = k;
        update.associations.push_back({static_cast<std::uint32_t>(i), one.id});
      }
      closer.add(frame);
      if (const auto closure = closer.add(update)) send(*closure);
    }
  }

  void send(const model::LoopClosure& closure) {
    SentClosure sent;
    sent.closure = closure;
    sent.from = closure.from.keyframe;
    sent.to = closure.to.keyframe;
    const SE2 truth = drive_.truth[sent.from].inverse() * drive_.truth[sent.to];
    const SE2 off = truth.inverse() * closure.from_T_to.mean;
    sent.kind =
        off.translation().norm() < 1.0 && std::abs(off.theta()) < 0.1 ? Kind::kRight : Kind::kRows;
    drive_.sent.push_back(sent);
  }

  PlantationPlan plan_;
  ClosurePlan closures_;
  std::uint64_t seed_;
  std::mt19937_64 random_;
  std::vector<Eigen::Vector2d> trees_;
  std::vector<double> radii_;
  ClosureDrive drive_;
};

}  // namespace

ClosureDrive make_plantation_drive(const PlantationPlan& plan, const ClosurePlan& closures,
                                   std::uint64_t seed) {
  return PlantationMaker(plan, closures, seed).make();
}

}  // namespace understory::eval::experiments::closures
