#include "services/landmark_extractor/trunks/stem_probe.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "services/landmark_extractor/points/spin_fit.hpp"

namespace understory::landmark_extractor::trunks {
namespace {

/// Beams that pass the axis within this share of the radius must hit the stem.
constexpr double kCore = 0.6;
/// Returns within this distance of the surface are on the stem [m].
constexpr double kOnStem_m = 0.12;
/// Above this height a trunk must be visible unless it is occluded.
constexpr double kFoot_m = 0.5;
/// Almost no person is taller [m].
constexpr double kPerson_m = 1.95;
/// Rings that pass farther above or below are skipped [m].
constexpr double kMargin_m = 0.5;
/// This number of beams cannot all be drop-outs.
constexpr double kSureBeams = 2.0;

enum class Met : std::uint8_t { kUnknown, kOn, kBeside, kThrough };

double largest_axis_sigma(const StemFit& fit, double z) {
  const double above = z - fit.reference_z_m;
  const auto variance = [&](int i) {
    return fit.covariance(i, i) + 2.0 * above * fit.covariance(i, i + 3) +
           above * above * fit.covariance(i + 3, i + 3);
  };
  return std::sqrt(std::max(variance(0), variance(1)));
}

float azimuth_of(const Eigen::Vector2d& offset) {
  return points::fast_atan2(static_cast<float>(offset.y()), static_cast<float>(offset.x()));
}

float apart(float a, float b) { return std::abs(points::wrap_angle_f(a - b)); }

/// The beams of one ring near a stem.
class Look {
 public:
  Look(const rings::RingCloud& cloud, std::size_t ring, const StemFit& fit, double clearance)
      : cloud_(cloud), ring_(ring), fit_(fit), clearance_(clearance) {
    const Eigen::Vector2d sensor = cloud.sensor_m().head<2>().cast<double>();
    // The sensor was at another position when its beams passed there: their azimuth gives the time.
    Eigen::Vector2d offset = fit.state.head<2>() - sensor;
    index_ = cloud.first_at(ring, azimuth_of(offset));
    const points::RingPoint& near = at(index_);
    for (int round = 0; round < 2; ++round) {
      origin_ = cloud.origin_towards(azimuth_of(offset), near);
      offset = fit.state.head<2>() - origin_;
    }
    z_m_ = cloud.sensor_m().z() + cloud.slope(ring, near, azimuth_of(offset)) * offset.norm();
  }

  /// Height of the ring at the stem.
  double z_m() const { return z_m_; }

  Met met() const {
    const Eigen::Vector2d offset = fit_.centre_at(z_m_) - origin_;
    const double distance = offset.norm();
    const double radius = std::max(0.01, fit_.radius_at(z_m_));
    const double core = kCore * radius - largest_axis_sigma(fit_, z_m_);
    if (core <= 0.0 || distance <= radius) return Met::kUnknown;

    // The points of the ring whose beams pass near the axis.
    const float azimuth = azimuth_of(offset);
    const auto half = static_cast<float>(core / distance);
    const std::size_t first = first_beyond(azimuth - half);
    const std::size_t count = cloud_.ring_end(ring_) - cloud_.ring_begin(ring_);
    Met result = Met::kUnknown;
    std::size_t seen = 0;
    for (; seen < count; ++seen) {
      const points::RingPoint& point = at(first + seen);
      if (apart(point.azimuth_rad, azimuth) > half) break;
      const double miss = distance * apart(point.azimuth_rad, azimuth);
      const double depth = std::sqrt(std::max(0.0, radius * radius - miss * miss));
      const double behind = point.range_m - (distance - depth);
      if (std::abs(behind) <= kOnStem_m) return Met::kOn;
      if (behind > -clearance_ && result != Met::kBeside) {
        result = behind > clearance_ ? Met::kThrough : Met::kBeside;
      }
    }

    const bool went_nowhere = seen == 0 && 2.0F * half > kSureBeams * cloud_.step_rad(ring_);
    return went_nowhere ? Met::kThrough : result;
  }

 private:
  /// Searches from the stem's index in the ring over a few points to an azimuth near by.
  std::size_t first_beyond(float azimuth) const {
    const std::size_t begin = cloud_.ring_begin(ring_);
    const std::size_t end = cloud_.ring_end(ring_);
    const auto beyond = [&](std::size_t i) {
      return points::wrap_angle_f(at(i).azimuth_rad - azimuth) >= 0.0F;
    };
    std::size_t i = index_ < end ? index_ : begin;
    for (std::size_t steps = end - begin; steps > 0; --steps) {
      if (!beyond(i)) break;
      i = i > begin ? i - 1 : end - 1;
    }
    for (std::size_t steps = end - begin; steps > 0 && !beyond(i); --steps) {
      i = i + 1 < end ? i + 1 : begin;
    }
    return i;
  }

  /// A point of the ring; indices beyond its end continue at its beginning.
  const points::RingPoint& at(std::size_t index) const {
    const std::size_t end = cloud_.ring_end(ring_);
    const std::size_t size = end - cloud_.ring_begin(ring_);
    return cloud_.points()[index < end ? index : index - size];
  }

  const rings::RingCloud& cloud_;
  std::size_t ring_;
  const StemFit& fit_;
  double clearance_;
  Eigen::Vector2d origin_ = Eigen::Vector2d::Zero();
  std::size_t index_ = 0;  ///< Of the point at the stem.
  double z_m_ = 0.0;
};

/// If no ring passes between a person's height and the least height of a trunk: whether the next
/// one above passes through.
bool ends_below_next_ring(const rings::RingCloud& cloud, const StemFit& fit, double ground_z,
                          const SweepParameters& parameters) {
  double lowest = ground_z + parameters.max_height_m;
  bool is_open = false;
  const Eigen::Vector2d offset = fit.state.head<2>() - cloud.sensor_m().head<2>().cast<double>();
  const double distance = offset.norm();
  const rings::RoughSlopes slopes = cloud.rough_slopes((offset / distance).cast<float>());
  for (std::size_t ring = 0; ring < cloud.rings(); ++ring) {
    if (cloud.step_rad(ring) <= 0.0F) continue;
    const double about = cloud.sensor_m().z() + slopes(ring) * distance;
    if (about < ground_z + parameters.standing_height_m - kMargin_m || about > lowest) continue;
    const Look look(cloud, ring, fit, parameters.clearance_m);
    if (look.z_m() < ground_z + parameters.standing_height_m || look.z_m() >= lowest) continue;
    lowest = look.z_m();
    is_open = look.met() == Met::kThrough;
  }
  return is_open;
}

}  // namespace

StemProbe probe_stem(const rings::RingCloud& cloud, const StemFit& fit, double ground_z,
                     const SweepParameters& parameters) {
  StemProbe result;
  double lowest_on = std::numeric_limits<double>::infinity();
  double highest_on = -lowest_on;
  double lowest_through = lowest_on;
  double highest_through = highest_on;

  // Rings that pass at the stem's height, by a rough estimate.
  const Eigen::Vector2d offset = fit.state.head<2>() - cloud.sensor_m().head<2>().cast<double>();
  const double distance = offset.norm();
  const rings::RoughSlopes slopes = cloud.rough_slopes((offset / distance).cast<float>());
  const double lowest = std::min(ground_z + kFoot_m, fit.low_z_m) - kMargin_m;
  const double highest =
      std::max(ground_z + parameters.standing_height_m, fit.high_z_m) + kMargin_m;
  for (std::size_t ring = 0; ring < cloud.rings(); ++ring) {
    if (cloud.step_rad(ring) <= 0.0F) continue;
    const double about = cloud.sensor_m().z() + slopes(ring) * distance;
    if (about < lowest || about > highest) continue;

    const Look look(cloud, ring, fit, parameters.clearance_m);
    const double z = look.z_m();
    const bool in_zone = z > ground_z + kFoot_m && z < ground_z + parameters.standing_height_m;
    const bool in_span = z >= fit.low_z_m && z <= fit.high_z_m;
    if (!in_zone && !in_span) continue;
    switch (look.met()) {
      case Met::kUnknown:
        break;
      case Met::kBeside:
        ++result.beside;
        break;
      case Met::kOn:
        ++result.on;
        lowest_on = std::min(lowest_on, z);
        highest_on = std::max(highest_on, z);
        break;
      case Met::kThrough:
        ++result.through;
        lowest_through = std::min(lowest_through, z);
        highest_through = std::max(highest_through, z);
        break;
    }
  }

  result.open_above =
      highest_through > highest_on ||
      (highest_on < ground_z + kPerson_m && ends_below_next_ring(cloud, fit, ground_z, parameters));
  result.open_below = lowest_through < lowest_on;
  return result;
}

}  // namespace understory::landmark_extractor::trunks
