// A drive round a forest whose odometry drifts, as keyframes; and a mapper that knows nothing but
// that odometry.
#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <vector>

#include "common/model/keyframe.hpp"
#include "common/model/map.hpp"
#include "common/model/odometry.hpp"
#include "common/model/place_scan.hpp"

namespace understory::test {

/// How it is driven.
struct RingOptions {
  std::uint64_t seed = 1;
  double radius_m = 60.0;
  double laps = 1.2;
  double step_m = 2.0;
  double range_m = 18.0;
  double seen_share = 0.7;  ///< Of the stems, drawn anew for each lap.
  double sigma_m = 0.03;
  double yaw_sigma_rad = 2e-3;  ///< Of odometry, per step.
  double yaw_bias_rad = 0.0;    ///< Likewise; nobody states it.
  double blind_from = 0.3;      ///< Share of the first lap from which on nothing is seen ...
  double blind_to = 0.6;        ///< ... to this.
};

/// Keyframes of one scan each, odometry between their bases, and the truth.
class RingDrive {
 public:
  explicit RingDrive(const RingOptions& options) : options_(options), random_(options.seed) {
    const double around_m = 2.0 * std::numbers::pi * options.radius_m;
    per_lap_ = static_cast<std::size_t>(around_m / options.step_m);
    const auto count = static_cast<std::size_t>(options.laps * static_cast<double>(per_lap_));
    plant();
    const double turn = options.step_m / options.radius_m;
    const geometry::SE2 step = geometry::SE2::Exp({options.step_m, 0.0, turn});
    for (std::size_t k = 0; k < count; ++k)
      truth_.push_back(k == 0 ? geometry::SE2() : truth_.back() * step);
    for (std::size_t k = 0; k < count; ++k) {
      keyframes_.push_back(keyframe(k));
      if (k > 0) odometry_.push_back(odometry(k));
    }
  }

  std::size_t size() const { return truth_.size(); }
  std::size_t per_lap() const { return per_lap_; }
  const geometry::SE2& truth(std::size_t k) const { return truth_[k]; }
  const model::Keyframe& keyframe_at(std::size_t k) const { return keyframes_[k]; }
  /// The laser's cloud at keyframe k: trunks as columns of points, each of its own height, those
  /// too that the detector missed; drawn anew for each keyframe.
  model::PlaceScan cloud_at(std::size_t k) const {
    std::mt19937_64 random(options_.seed * 7'919 + k);
    std::normal_distribution<double> normal(0.0, options_.sigma_m);
    model::PlaceScan scan;
    scan.utime = keyframes_[k].utime;
    scan.sequence = k;
    for (std::size_t tree = 0; tree < trees_.size(); ++tree) {
      const Eigen::Vector2d at = truth_[k].inverse() * trees_[tree];
      if (at.norm() > 2.0 * options_.range_m) continue;
      const double height_m = 1.0 + static_cast<double>((tree * 37) % 50) / 10.0;
      for (double z = 0.0; z < height_m; z += 0.5) {
        const double x = at.x() + normal(random), y = at.y() + normal(random);
        scan.points.push_back(model::place_point(
            Eigen::Vector3f(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z))));
      }
    }
    return scan;
  }
  /// From k - 1 to k.
  const model::Odometry& odometry_to(std::size_t k) const { return odometry_[k - 1]; }
  /// Tree of each landmark of a keyframe.
  const std::vector<std::size_t>& trees_of(std::size_t k) const { return trees_of_[k]; }

 private:
  void plant() {
    const double side_m = 2.0 * (options_.radius_m + options_.range_m);
    std::uniform_real_distribution<double> place(0.0, side_m);
    const Eigen::Vector2d low(-0.5 * side_m, -options_.range_m);
    const auto count = static_cast<std::size_t>(0.015 * side_m * side_m);
    while (trees_.size() < count) {
      const double x = place(random_);
      const Eigen::Vector2d tree = low + Eigen::Vector2d(x, place(random_));
      const bool is_alone = std::none_of(trees_.begin(), trees_.end(), [&](const auto& other) {
        return (other - tree).norm() < 1.0;
      });
      if (is_alone) trees_.push_back(tree);
    }
  }

  bool is_seen(std::size_t tree, std::size_t lap) const {
    std::mt19937_64 one(options_.seed * 1'000'003 + tree * 97 + lap);
    one.discard(3);
    return std::uniform_real_distribution<double>(0.0, 1.0)(one) < options_.seen_share;
  }

  model::Keyframe keyframe(std::size_t k) {
    model::Keyframe out;
    out.utime = static_cast<model::Utime>(k + 1) * 1'000'000;
    out.sequence = k;
    out.field_of_view.max_range_m = options_.range_m;
    out.members.push_back({out.utime, k, {}, Eigen::Matrix3d::Zero()});
    const double share = static_cast<double>(k) / static_cast<double>(per_lap_);
    const bool is_blind = share >= options_.blind_from && share < options_.blind_to;
    auto& trees = trees_of_.emplace_back();
    for (std::size_t tree = 0; tree < trees_.size() && !is_blind; ++tree) {
      const Eigen::Vector2d at = truth_[k].inverse() * trees_[tree];
      // A lap begins where the way of the one before is out of sight.
      if (at.norm() > options_.range_m || !is_seen(tree, (k + per_lap_ / 2) / per_lap_)) continue;
      model::KeyframeLandmark landmark;
      const double x = normal_(random_), y = normal_(random_);
      landmark.position_m = at + options_.sigma_m * Eigen::Vector2d(x, y);
      landmark.covariance_m2 = options_.sigma_m * options_.sigma_m * Eigen::Matrix2d::Identity();
      landmark.observation_count = 8;
      out.landmarks.push_back(landmark);
      trees.push_back(tree);
    }
    return out;
  }

  model::Odometry odometry(std::size_t k) {
    const Eigen::Vector3d sigma(0.02, 0.02, options_.yaw_sigma_rad);
    const double x = normal_(random_), y = normal_(random_), z = normal_(random_);
    const Eigen::Vector3d noise = sigma.cwiseProduct(Eigen::Vector3d(x, y, z)) +
                                  Eigen::Vector3d(0.0, 0.0, options_.yaw_bias_rad);
    model::Odometry out;
    out.from_utime = keyframes_[k - 1].utime;
    out.utime = keyframes_[k].utime;
    out.sequence = k - 1;
    out.from_T_to = truth_[k - 1].inverse() * truth_[k] * geometry::SE2::Exp(noise);
    out.covariance = sigma.array().square().matrix().asDiagonal();
    out.has_wheels = true;
    return out;
  }

  RingOptions options_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  std::size_t per_lap_ = 0;
  std::vector<Eigen::Vector2d> trees_;
  std::vector<geometry::SE2> truth_;
  std::vector<model::Keyframe> keyframes_;
  std::vector<model::Odometry> odometry_;
  std::vector<std::vector<std::size_t>> trees_of_;
};

/// Dead reckoning. Each landmark is of its tree as long as that is seen again within 20 keyframes;
/// later it is another landmark, as for a mapper that has drifted; or it is always the same one.
class ReckoningMapper {
 public:
  explicit ReckoningMapper(const RingDrive& drive, bool knows_again = false)
      : drive_(drive), knows_again_(knows_again) {}

  /// What became of keyframe k; they come in order.
  model::MapUpdate update(std::size_t k) {
    if (k > 0) {
      const model::Odometry& step = drive_.odometry_to(k);
      pose_ = compound(pose_, {step.from_T_to, step.covariance});
    }
    model::MapUpdate out;
    out.keyframe_sequence = k;
    out.utime = drive_.keyframe_at(k).utime;
    out.status = k == 0 ? model::MapUpdateStatus::kFirstMap : model::MapUpdateStatus::kUpdated;
    out.map_T_vehicle = pose_.mean;
    out.covariance = pose_.covariance;
    const auto& trees = drive_.trees_of(k);
    for (std::size_t i = 0; i < trees.size(); ++i) {
      auto& landmark = landmarks_[trees[i]];
      if (landmark.id == 0 || (!knows_again_ && k - landmark.seen > 20)) landmark.id = ++newest_;
      landmark.seen = k;
      out.associations.push_back({static_cast<std::uint32_t>(i), landmark.id});
    }
    return out;
  }

 private:
  struct Landmark {
    model::LandmarkId id = 0;
    std::size_t seen = 0;
  };
  const RingDrive& drive_;
  bool knows_again_;
  geometry::SE2WithCovariance pose_;
  std::map<std::size_t, Landmark> landmarks_;
  model::LandmarkId newest_ = model::LandmarkId{1} << model::kLandmarkCounterBits;
};

}  // namespace understory::test
