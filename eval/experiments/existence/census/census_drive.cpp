#include "eval/experiments/existence/census/census_drive.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace understory::eval::experiments::existence::census {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr double kSpeed_mps = 2.0;
constexpr double kBreast_m = 1.3;
/// Of odometry from place to place.
constexpr double kStepSigma_m = 0.003;
constexpr double kStepSigma_rad = 1e-4;
/// Of VIEW_RANGES, as the extractor makes them for a turning laser.
constexpr int kBins = 720;
constexpr double kBeamStep_rad = 0.0035;
/// What no stem in range stops is free so far beyond it [m].
constexpr double kBeyond_m = 1.0;
constexpr double kSteps = 254.0;

/// Poses every so far on a straight line or a half circle to the left or right of `from`.
void add_way(double length_m, double curvature, double every_m, std::vector<geometry::SE2>& path) {
  const geometry::SE2 from = path.back();
  const int steps = static_cast<int>(std::round(length_m / every_m));
  for (int i = 1; i <= steps; ++i) {
    const double way_m = length_m * i / steps;
    path.push_back(from * geometry::SE2::Exp({way_m, 0.0, curvature * way_m}));
  }
}

}  // namespace

std::vector<geometry::SE2> lanes_there_and_back(const std::vector<CensusStem>& stems,
                                                const ForestSetting& setting, double shift_m) {
  Eigen::Vector2f low = stems.front().place_m, high = low;
  for (const CensusStem& stem : stems) {
    low = low.cwiseMin(stem.place_m);
    high = high.cwiseMax(stem.place_m);
  }
  const double lane_m = high.x() - low.x();
  const double radius_m = 0.5 * setting.lane_m;

  std::vector<geometry::SE2> path{{low.x(), low.y() + shift_m, 0.0}};
  double side = 1.0;
  while (true) {
    add_way(lane_m, 0.0, setting.scan_every_m, path);
    if (path.back().y() + setting.lane_m > high.y()) return path;
    add_way(std::numbers::pi * radius_m, side / radius_m, setting.scan_every_m, path);
    side = -side;
  }
}

CensusErrors census_errors(bool are_shared) {
  if (!are_shared) return {};
  return {sim::kMeasuredIndependentSigmaM, sim::measured_sigma_m(), sim::measured_shared_errors()};
}

CensusDrive::CensusDrive(ForestDrive& looks, std::vector<geometry::SE2> path, model::Utime begin,
                         const CensusErrors& errors, std::uint64_t forest_seed,
                         std::uint64_t drive_seed, std::mt19937_64& random)
    : looks_(looks),
      path_(std::move(path)),
      begin_(begin),
      errors_(errors),
      shared_(errors.shared, forest_seed, drive_seed),
      random_(random) {}

std::optional<CensusScan> CensusDrive::next(double range_m) {
  if (next_ == path_.size()) return std::nullopt;
  const std::size_t index = next_++;
  const geometry::SE2& pose = path_[index];
  const std::size_t first_look = looks_.looks().size();
  looks_.scan(pose.translation().cast<float>());

  const double way_m =
      index == 0 ? 0.0 : (pose.translation() - path_[index - 1].translation()).norm();
  along_m_ += way_m;
  CensusScan scan;
  if (index > 0) {
    const model::Utime before = begin_;
    begin_ += static_cast<model::Utime>(std::round(1e6 * way_m / kSpeed_mps));
    scan.odometry = odometry_to(index);
    scan.odometry->from_utime = before;
    scan.odometry->utime = begin_;
  }
  scan.landmarks = landmarks_at(pose, first_look, scan.stems);
  scan.landmarks.field_of_view.max_range_m = range_m;
  scan.view = view_from(pose, range_m);
  scan.landmarks.utime = scan.view.utime = begin_;
  scan.landmarks.sequence = scan.view.sequence = index;
  return scan;
}

model::Odometry CensusDrive::odometry_to(std::size_t index) {
  model::Odometry motion;
  motion.sequence = index - 1;
  motion.from_T_to =
      path_[index - 1].inverse() * path_[index] *
      geometry::SE2::Exp({kStepSigma_m * draw(), kStepSigma_m * draw(), kStepSigma_rad * draw()});
  motion.covariance = Eigen::Vector3d(kStepSigma_m * kStepSigma_m, kStepSigma_m * kStepSigma_m,
                                      kStepSigma_rad * kStepSigma_rad)
                          .asDiagonal();
  motion.has_wheels = true;
  return motion;
}

model::LandmarkScan CensusDrive::landmarks_at(const geometry::SE2& pose, std::size_t first_look,
                                              std::vector<std::uint32_t>& stems) {
  model::LandmarkScan scan;
  const std::vector<StemInView>& view = looks_.view();
  for (std::size_t i = 0; i < view.size(); ++i) {
    const LookEvent& look = looks_.looks()[first_look + i];
    if (!look.is_seen) continue;
    const Eigen::Vector2d stem_m =
        pose.translation() - look.look.from_point_m.head<2>().cast<double>();
    const Eigen::Vector2d true_m = pose.inverse() * stem_m;
    const Eigen::Vector2d seen_m = true_m +
                                   errors_.independent_sigma_m * Eigen::Vector2d(draw(), draw()) +
                                   shared_.error_m(look.point, true_m, pose, along_m_);
    model::Detection detection;
    detection.position_m = {seen_m.x(), seen_m.y(), kBreast_m};
    detection.covariance_m2 =
        errors_.stated_sigma_m * errors_.stated_sigma_m * Eigen::Matrix3d::Identity();
    detection.radius_m =
        static_cast<double>(view[i].distance_m) * std::sin(static_cast<double>(view[i].half_width));
    scan.detections.push_back(detection);
    stems.push_back(look.point);
  }
  return scan;
}

model::ViewRanges CensusDrive::view_from(const geometry::SE2& pose, double range_m) const {
  model::ViewRanges ranges;
  ranges.step_rad = kTurn / kBins;
  ranges.beam_step_rad = kBeamStep_rad;
  ranges.range_step_m = (range_m + kBeyond_m) / kSteps;
  // Nearest first: what a bin has met it keeps.
  std::vector<double> met_m(kBins, 0.0);
  for (const StemInView& one : looks_.view()) {
    if (!looks_.stands(one.stem)) continue;
    const double bearing = static_cast<double>(one.bearing) - pose.theta();
    const double half = static_cast<double>(one.half_width);
    const int from = static_cast<int>(std::floor((bearing - half) / ranges.step_rad));
    const int to = static_cast<int>(std::floor((bearing + half) / ranges.step_rad));
    for (int i = from; i <= to; ++i) {
      double& bin_m = met_m[static_cast<std::size_t>(((i % kBins) + kBins) % kBins)];
      if (bin_m == 0.0) bin_m = static_cast<double>(one.distance_m);
    }
  }

  for (const double met : met_m) {
    const double free_m = met > 0.0 ? met : range_m + kBeyond_m;
    const auto free = static_cast<std::uint8_t>(std::floor(free_m / ranges.range_step_m));
    ranges.free.push_back(free);
    ranges.hidden.push_back(met > 0.0 ? free + 1 : 0);
  }
  return ranges;
}

}  // namespace understory::eval::experiments::existence::census
