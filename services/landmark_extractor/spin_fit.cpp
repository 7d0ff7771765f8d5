#include "services/landmark_extractor/spin_fit.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace understory {
namespace {

constexpr float kTurn = 2.0F * std::numbers::pi_v<float>;
/// So many points tell the motion well enough.
constexpr std::size_t kSample = 3000;
constexpr int kRounds = 3;
/// So many neighbours tell the rate of the spin well enough to begin with.
constexpr std::size_t kRates = 300;
/// Beams turn evenly to this [rad]; a motor that does not says nothing of the motion.
constexpr double kEvenness = 0.01;
/// A vehicle is not faster [m/s].
constexpr double kSpeedPrior = 40.0;

}  // namespace

/// Rate of the spin [rad/s] from neighbours of one ring: the median; and which way it goes.
float SpinFitter::look_at_neighbours(const PointSweep& sweep, std::uint16_t ring, Spin& spin) {
  rates_.clear();
  std::ptrdiff_t leftward = 0;
  std::size_t seen = 0;
  const SweepPoint* previous = nullptr;
  const auto cx = static_cast<float>(sweep.sensor_position_m.x());
  const auto cy = static_cast<float>(sweep.sensor_position_m.y());
  for (const SweepPoint& point : sweep.points) {
    if (point.ring != ring) continue;
    if (previous != nullptr) {
      const float change = std::remainder(fast_atan2(point.y_m - cy, point.x_m - cx) -
                                              fast_atan2(previous->y_m - cy, previous->x_m - cx),
                                          kTurn);
      if (std::isfinite(change)) {
        ++seen;
        leftward += change > 0.0F ? 1 : -1;
        const float time = point.time_s - previous->time_s;
        if (time > 0.0F) rates_.push_back(change / time);
      }
    }
    previous = &point;
    if (seen >= kRates) break;
  }
  spin.is_leftward = leftward >= 0;
  if (rates_.empty()) return 0.0F;
  const auto middle = rates_.begin() + static_cast<std::ptrdiff_t>(rates_.size() / 2);
  std::nth_element(rates_.begin(), middle, rates_.end());
  return *middle;
}

void SpinFitter::take_samples(const PointSweep& sweep, double max_range_m) {
  const std::size_t stride = std::max<std::size_t>(1, sweep.points.size() / kSample);
  // Prime to the number of rings, so that every ring gets its share.
  const std::size_t step = stride + (stride % 2 == 0 ? 1 : 0);
  samples_.clear();
  means_.assign(sweep.rings, {});
  const Eigen::Vector3f sensor = sweep.sensor_position_m.cast<float>();
  for (std::size_t i = 0; i < sweep.points.size(); i += step) {
    const SweepPoint& point = sweep.points[i];
    if (point.ring >= sweep.rings) continue;
    const Eigen::Vector3f p = point.position() - sensor;
    const float range = std::sqrt(p.x() * p.x() + p.y() * p.y());
    if (!(range > 1.0F && range < static_cast<float>(max_range_m)) || !p.allFinite()) continue;
    samples_.push_back({p.x(), p.y(), point.time_s, point.ring});
    means_[point.ring].slope_sum += p.z() / range;
    means_[point.ring].slopes += 1.0F;
  }
}

void SpinFitter::improve() {
  for (Means& mean : means_) {
    mean.count = 0.0;
    mean.sum.setZero();
  }
  Eigen::Matrix4d sums = Eigen::Matrix4d::Zero();
  for (const Sample& sample : samples_) {
    const float x = sample.x - static_cast<float>(velocity_.x()) * sample.time_s;
    const float y = sample.y - static_cast<float>(velocity_.y()) * sample.time_s;
    const float range2 = x * x + y * y;
    const float turned = fast_atan2(y, x) - static_cast<float>(rate_) * sample.time_s;
    Means& mean = means_[sample.ring];
    if (mean.count == 0.0) mean.offset = turned;
    const float residual = std::remainder(turned - mean.offset, kTurn);
    // d azimuth / d velocity = time * (y, -x) / range^2.
    const float lever = sample.time_s / range2;
    const Eigen::Vector4d row(sample.time_s, lever * y, -lever * x, residual);
    mean.count += 1.0;
    mean.sum += row;
    sums += row * row.transpose();
  }
  double count = 1.0;
  for (const Means& mean : means_) {
    if (mean.count > 0.0) sums -= mean.sum * mean.sum.transpose() / mean.count;
    count += mean.count;
  }
  // residual + d(residual)/d(rate, v) * change = 0, where d(residual)/d(rate) = -time.
  Eigen::Matrix3d information = sums.topLeftCorner<3, 3>();
  Eigen::Vector3d gradient = sums.topRightCorner<3, 1>();
  information.row(0) *= -1.0;
  information.col(0) *= -1.0;
  gradient[0] *= -1.0;
  const double prior = kEvenness * kEvenness / (kSpeedPrior * kSpeedPrior);
  information(1, 1) += prior;
  information(2, 2) += prior;
  information(0, 0) += 1e-12;
  const Eigen::Vector3d change = -information.ldlt().solve(gradient);
  residual_rms_ = std::sqrt(std::max(0.0, sums(3, 3) + change.dot(gradient)) / count);
  if (!change.allFinite()) {
    residual_rms_ = std::numeric_limits<double>::infinity();
    return;
  }
  rate_ += change[0];
  velocity_ += change.tail<2>();
}

void SpinFitter::fit(const PointSweep& sweep, double max_range_m, Spin& spin) {
  take_samples(sweep, max_range_m);
  spin.velocity_mps.setZero();
  spin.is_leftward = true;
  spin.slopes.clear();
  std::size_t fullest = 0;
  for (std::size_t ring = 0; ring < means_.size(); ++ring) {
    const Means& mean = means_[ring];
    spin.slopes.push_back(mean.slopes > 0.0F ? mean.slope_sum / mean.slopes
                                             : std::numeric_limits<float>::quiet_NaN());
    if (mean.slopes > means_[fullest].slopes) fullest = ring;
  }
  if (samples_.empty()) return;
  rate_ = look_at_neighbours(sweep, static_cast<std::uint16_t>(fullest), spin);
  if (!sweep.has_times || rate_ == 0.0) return;
  velocity_.setZero();
  residual_rms_ = std::numeric_limits<double>::infinity();
  for (int round = 0; round < kRounds; ++round) improve();
  if (residual_rms_ < kEvenness) spin.velocity_mps = velocity_.cast<float>();
}

}  // namespace understory
