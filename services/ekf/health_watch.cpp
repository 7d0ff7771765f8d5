#include "services/ekf/health_watch.hpp"

#include <cmath>

#include "common/geometry/decompositions.hpp"

namespace understory::ekf {
namespace {

std::uint64_t refused_messages(const EkfCounters& counters) {
  return counters.odometry_refused + counters.scans_refused;
}

}  // namespace

void describe(HealthParameters& p, bus::ParameterTable& table) {
  table.add("health.min_observations", p.min_observations, {1, 10000}, "",
            "Scans with fewer landmarks are not judged.");
  table.add("health.lost_sigma_m", p.lost_sigma_m, {0.01, 1e6}, "m",
            "The filter is lost with a larger standard deviation of the position, unless its map "
            "began with such a one.");
  table.add("health.nis_sigmas", p.nis_sigmas, {1.0, 100.0}, "sigma",
            "A scan's innovations are too large if their squared distance exceeds its expectation "
            "by this many standard deviations ...");
  table.add("health.nis_ratio", p.nis_ratio, {1.0, 1000.0}, "", "... and by this factor.");
  describe(p.lost, "lost", "scans", "those without a used landmark.", table);
  describe(p.diverged, "diverged", "scans", "those with too large innovations.", table);
  describe(p.restarted, "restarted", "scans", "those after which the filter restarted.", table);
  describe(p.refused, "refused", "messages", "those that are late or malformed.", table);
}

HealthWatch::HealthWatch(const HealthParameters& parameters)
    : parameters_(parameters),
      lost_{wire::Reason::kLost, "landmarks come and none is used, or the position is not known",
            "", bus::Condition(parameters.lost)},
      diverged_{wire::Reason::kDiverged, "landmarks are farther off than the filter states", "",
                bus::Condition(parameters.diverged)},
      restarted_{wire::Reason::kRestarted, "the filter's map began anew", "",
                 bus::Condition(parameters.restarted)},
      refused_{wire::Reason::kInputRefused, "odometry or scans are late or broken", "",
               bus::Condition(parameters.refused)} {}

void HealthWatch::add(const EkfOutput& output, const EkfCounters& before,
                      const EkfCounters& after) {
  refused_.condition.add(refused_messages(after) > refused_messages(before));
  const bool restarted = after.restarts > before.restarts;
  if (restarted || output.scan) restarted_.condition.add(restarted);
  has_restarted_ = has_restarted_ || restarted;
  if (output.scan && output.pose) add_scan(*output.scan, *output.pose);
}

void HealthWatch::add_scan(const ScanFit& scan, const model::EkfPose& pose) {
  const bool has_landmarks =
      scan.observed >= static_cast<std::uint32_t>(parameters_.min_observations);
  const Eigen::Matrix2d position = pose.covariance.topLeftCorner<2, 2>();
  const double sigma_m = std::sqrt(geometry::eigenvalues(position).maxCoeff());
  const bool is_certain = sigma_m <= parameters_.lost_sigma_m;
  knows_place_ = is_certain || (knows_place_ && !has_restarted_);
  has_restarted_ = false;
  const bool is_uncertain = knows_place_ && !is_certain;
  if (has_landmarks || is_uncertain) {
    lost_.condition.add(is_uncertain || scan.used == 0);
  }

  if (scan.nis_degrees == 0) return;
  const auto degrees = static_cast<double>(scan.nis_degrees);
  const double deviate = (scan.nis - degrees) / std::sqrt(2.0 * degrees);
  diverged_.condition.add(deviate > parameters_.nis_sigmas &&
                          scan.nis > parameters_.nis_ratio * degrees);
}

}  // namespace understory::ekf
