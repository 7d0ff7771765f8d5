#include "eval/experiments/frontend/ekf_consistency.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "eval/tools/thread_clock.hpp"
#include "services/associator/associator.hpp"
#include "services/ekf/chi_squared.hpp"
#include "services/ekf/ekf.hpp"

namespace understory::eval::experiments::frontend {
namespace {

double percentile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

/// 95 % of the means over so many runs lie in it.
struct Band {
  double low = 0.0;
  double high = 0.0;
};
Band band_of_mean(std::size_t runs) {
  const auto degrees = static_cast<int>(3 * runs);
  const auto count = static_cast<double>(runs);
  return {ekf::chi_squared_quantile(0.025, degrees) / count,
          ekf::chi_squared_quantile(0.975, degrees) / count};
}

/// The scan with its true identities; false detections get a fresh one each.
model::TrackedScan true_tracks(const sim::DriveStep& step, model::TrackId& next_false) {
  model::TrackedScan tracked{step.scan.utime, step.scan.sequence, step.scan.field_of_view, {}};
  for (std::uint32_t i = 0; i < step.scan.detections.size(); ++i) {
    const std::int64_t trunk = step.trunks[i];
    const model::TrackId id = trunk >= 0 ? static_cast<model::TrackId>(trunk) + 1 : next_false++;
    tracked.landmarks.push_back({id, i, step.scan.detections[i]});
  }
  return tracked;
}

double velocity_nees(const model::VelocityCorrection& correction, const sim::DriveStep& step,
                     bool has_bias) {
  const Eigen::Vector2d truth = step.world_T_vehicle.rotation().transpose() * step.velocity_mps;
  Eigen::Matrix<double, 5, 1> error;
  error << truth - correction.velocity_mps, step.bias - correction.bias;
  if (!has_bias) error.tail<3>().setZero();
  return error.dot(correction.covariance.llt().solve(error));
}

}  // namespace

void add_pose_nees(const model::EkfPose& pose, const geometry::SE2& truth, EkfDriveResult& result) {
  const Eigen::Vector3d error = (pose.ekf_map_T_vehicle.inverse() * truth).Log();
  // The first pose is the map's origin: exact, and so is its covariance.
  const Eigen::Matrix3d covariance = pose.covariance + 1e-14 * Eigen::Matrix3d::Identity();
  const Eigen::Vector2d place = error.head<2>();
  const Eigen::Matrix2d place_covariance = covariance.topLeftCorner<2, 2>();
  result.nees.push_back(error.dot(covariance.llt().solve(error)));
  result.position_nees.push_back(place.dot(place_covariance.llt().solve(place)));
  result.heading_nees.push_back(error.z() * error.z() / covariance(2, 2));
  result.error_m2.push_back(place.squaredNorm());
  result.claimed_m2.push_back(place_covariance.trace());
}

EkfDriveResult run_ekf_drive(const EkfDriveOptions& options, const sim::TrunkField& world,
                             std::uint64_t seed) {
  sim::InertialDrive drive(options.drive, world, seed);
  ekf::Ekf filter(options.filter);
  associator::Associator associator(options.associator);
  EkfDriveResult result;
  model::TrackId next_false = model::TrackId{1} << 32;
  const auto scans = static_cast<std::size_t>(options.duration_s / options.drive.scan_interval_s);
  const bool has_bias = options.drive.odometry != sim::OdometryKind::kWheels &&
                        options.drive.odometry != sim::OdometryKind::kNone;
  geometry::SE2 start;
  double active = 0.0;
  for (std::size_t k = 0; k < scans; ++k) {
    const sim::DriveStep step = drive.next();
    if (k == 0) start = step.world_T_vehicle;
    for (const model::Odometry& increment : step.odometry) {
      filter.add(increment);
      associator.add(increment);
    }
    const model::TrackedScan tracked =
        options.use_associator ? *associator.add(step.scan) : true_tracks(step, next_false);
    const double before = tools::thread_time_s();
    const ekf::EkfOutput output = filter.add(tracked);
    const double taken = tools::thread_time_s() - before;
    associator.add(*output.pose);
    result.update_s.push_back(taken);
    const geometry::SE2 truth = start.inverse() * step.world_T_vehicle;
    add_pose_nees(*output.pose, truth, result);
    result.velocity_nees.push_back(velocity_nees(*output.correction, step, has_bias));
    active += static_cast<double>(output.map->landmarks.size());
    const Eigen::Vector3d error = (truth.inverse() * output.pose->ekf_map_T_vehicle).coordinates();
    result.final_error_m = error.head<2>().norm();
    result.final_error_rad = std::abs(error.z());
    result.driven_m = step.driven_m;
  }
  result.restarts = filter.counters().restarts;
  result.landmarks_refused = filter.counters().landmarks_refused;
  result.landmarks_used = filter.counters().landmarks_used;
  result.mean_active_landmarks = active / static_cast<double>(std::max<std::size_t>(1, scans));
  return result;
}

EkfConsistency summarise(const std::vector<EkfDriveResult>& runs) {
  EkfConsistency out;
  out.runs = static_cast<int>(runs.size());
  if (runs.empty()) return out;

  const auto count = static_cast<double>(runs.size());
  const Band band = band_of_mean(runs.size());
  out.band_low = band.low;
  out.band_high = band.high;
  out.mean_nees.assign(runs.front().nees.size(), 0.0);

  // Sums over the runs.
  std::vector<double> times;
  double squared = 0.0, used = 0.0, refused = 0.0;
  double velocity = 0.0, heading = 0.0, position = 0.0;

  for (const EkfDriveResult& run : runs) {
    for (std::size_t k = 0; k < out.mean_nees.size(); ++k) {
      out.mean_nees[k] += run.nees[k] / count;
      velocity += run.velocity_nees[k];
      heading += run.heading_nees[k];
      position += run.position_nees[k];
    }
    times.insert(times.end(), run.update_s.begin(), run.update_s.end());
    const double share = run.final_error_m / std::max(1.0, run.driven_m);
    squared += share * share;
    out.driven_m += run.driven_m / count;
    out.mean_active_landmarks += run.mean_active_landmarks / count;
    out.restarts += run.restarts;
    used += static_cast<double>(run.landmarks_used);
    refused += static_cast<double>(run.landmarks_refused);
  }

  // Means.
  const auto scans = static_cast<double>(out.mean_nees.size());
  for (const double nees : out.mean_nees) out.overall_nees += nees / scans;
  out.heading_nees = heading / (scans * count);
  out.position_nees = position / (scans * count);
  out.final_nees = out.mean_nees.back();
  out.overall_velocity_nees = velocity / (scans * count);
  out.drift_percent = 100.0 * std::sqrt(squared / count);
  out.update_p50_s = percentile(times, 0.5);
  out.update_p99_s = percentile(times, 0.99);
  out.refused_share = refused / std::max(1.0, used + refused);
  return out;
}

double share_in_band(std::span<const EkfDriveResult> runs, ScanRange scans, std::size_t group) {
  group = std::clamp<std::size_t>(group, 1, std::max<std::size_t>(1, runs.size()));
  const Band band = band_of_mean(group);
  std::size_t inside = 0;
  std::size_t all = 0;
  for (std::size_t at = 0; at + group <= runs.size(); at += group) {
    for (std::size_t k = scans.first; k < scans.last; ++k) {
      const double mean = mean_nees(runs.subspan(at, group), {k, k + 1});
      inside += static_cast<std::size_t>(mean >= band.low && mean <= band.high);
      ++all;
    }
  }
  return static_cast<double>(inside) / static_cast<double>(std::max<std::size_t>(1, all));
}

double mean_nees(std::span<const EkfDriveResult> runs, ScanRange scans) {
  double sum = 0.0;
  for (const EkfDriveResult& run : runs) {
    for (std::size_t k = scans.first; k < scans.last; ++k) sum += run.nees[k];
  }
  const std::size_t count = runs.size() * (scans.last - scans.first);
  return sum / static_cast<double>(std::max<std::size_t>(1, count));
}

}  // namespace understory::eval::experiments::frontend
