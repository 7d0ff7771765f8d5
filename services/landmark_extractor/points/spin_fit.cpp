#include "services/landmark_extractor/points/spin_fit.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace understory::landmark_extractor::points {
namespace {

constexpr float kTurn = 2.0F * std::numbers::pi_v<float>;
/// Number of points that is sufficient for the motion.
constexpr std::size_t kSample = 2000;
constexpr std::size_t kTogether = 4;
constexpr int kRounds = 3;
/// The iteration ends when the next step would be smaller than the square of this, relative to the
/// range.
constexpr double kSettledRate = 0.01;
constexpr double kSettledSpeed_mps = 0.3;
/// Number of neighbours that is sufficient for the initial rate of the spin.
constexpr std::size_t kRates = 300;
/// Largest deviation from a constant rate [rad]; with an uneven motor the motion cannot be
/// estimated.
constexpr double kEvenness = 0.01;
/// Upper bound of a vehicle's speed [m/s].
constexpr double kSpeedPrior = 40.0;

}  // namespace

/// Rate of the spin [rad/s] from neighbours of one ring: the median; and its direction.
float SpinFitter::look_at_neighbours(const model::PointSweep& sweep, std::uint16_t ring,
                                     Spin& spin) {
  rates_.clear();
  std::ptrdiff_t leftward = 0;
  std::size_t seen = 0;
  const model::SweepPoint* previous = nullptr;
  const auto cx = static_cast<float>(sweep.sensor_position_m.x());
  const auto cy = static_cast<float>(sweep.sensor_position_m.y());
  for (const model::SweepPoint& point : sweep.points) {
    if (point.ring != ring) continue;
    if (previous != nullptr) {
      const float change = fast_atan2(point.y_m - cy, point.x_m - cx) -
                           fast_atan2(previous->y_m - cy, previous->x_m - cx);
      if (std::abs(change) < 0.5F * kTurn) {
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

void SpinFitter::take_samples(const model::PointSweep& sweep, double max_range_m) {
  // Several neighbours at a time, which share cache lines.
  const std::size_t stride = kTogether * std::max<std::size_t>(1, sweep.points.size() / kSample);
  samples_.clear();
  means_.assign(sweep.rings, {});
  const Eigen::Vector3f sensor = sweep.sensor_position_m.cast<float>();
  const auto take = [&](const model::SweepPoint& point) {
    if (point.ring >= sweep.rings) return;
    const Eigen::Vector3f p = point.position() - sensor;
    const float range = std::sqrt(p.x() * p.x() + p.y() * p.y());
    if (!(range > 1.0F && range < static_cast<float>(max_range_m)) || !p.allFinite()) return;
    samples_.push_back({p.x(), p.y(), point.time_s, point.ring});
    ++means_[point.ring].samples;
  };

  std::size_t shift = 0;
  for (std::size_t first = 0; first < sweep.points.size(); first += stride + shift) {
    const std::size_t end = std::min(first + kTogether, sweep.points.size());
    for (std::size_t i = first; i < end; ++i) take(sweep.points[i]);
    // Alternates longer and shorter steps, so that every ring is sampled.
    shift = (shift + kTogether + 1) % (3 * kTogether);
  }
}

bool SpinFitter::improve() {
  for (Means& mean : means_) {
    mean.count = 0.0;
    mean.sum.setZero();
  }

  // Residuals and derivatives of all samples.
  rows_.resize(samples_.size());
  const Eigen::Vector2f velocity = velocity_.cast<float>();
  const auto rate = static_cast<float>(rate_);
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    const Sample& sample = samples_[i];
    const float x = sample.x - velocity.x() * sample.time_s;
    const float y = sample.y - velocity.y() * sample.time_s;
    // d azimuth / d velocity = time * (y, -x) / range^2.
    const float lever = sample.time_s / (x * x + y * y);
    rows_[i] = {sample.time_s, lever * y, -lever * x, fast_atan2(y, x) - rate * sample.time_s};
  }

  // Their sums, with each ring's mean subtracted.
  Eigen::Matrix4d sums = Eigen::Matrix4d::Zero();
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    Means& mean = means_[samples_[i].ring];
    if (mean.count == 0.0) mean.offset = rows_[i].turned;
    const Eigen::Vector4d row(rows_[i].time_s, rows_[i].by_x, rows_[i].by_y,
                              wrap_angle_f(rows_[i].turned - mean.offset));
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
    return false;
  }
  rate_ += change[0];
  velocity_ += change.tail<2>();
  return std::abs(change[0]) > kSettledRate || change.tail<2>().norm() > kSettledSpeed_mps;
}

void SpinFitter::fit(const model::PointSweep& sweep, double max_range_m, Spin& spin) {
  take_samples(sweep, max_range_m);
  spin.velocity_mps.setZero();
  spin.rate_radps = 0.0F;
  spin.is_leftward = true;
  std::size_t fullest = 0;
  for (std::size_t ring = 0; ring < means_.size(); ++ring) {
    if (means_[ring].samples > means_[fullest].samples) fullest = ring;
  }
  if (samples_.empty()) return;

  rate_ = look_at_neighbours(sweep, static_cast<std::uint16_t>(fullest), spin);
  if (!sweep.has_times || rate_ == 0.0) return;
  velocity_.setZero();
  residual_rms_ = std::numeric_limits<double>::infinity();
  for (int round = 0; round < kRounds && improve(); ++round) {
  }

  if (residual_rms_ >= kEvenness) return;
  spin.velocity_mps = velocity_.cast<float>();
  spin.rate_radps = static_cast<float>(rate_);
}

}  // namespace understory::landmark_extractor::points
