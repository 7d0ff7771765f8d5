#include "services/landmark_extractor/spin_fit.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace understory {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr float kTurn = 2.0F * kPi;
/// So many points tell the motion well enough.
constexpr std::size_t kSample = 3000;
constexpr int kRounds = 3;
/// So many neighbours tell the rate of the spin well enough to begin with.
constexpr std::size_t kRates = 300;
/// Beams turn evenly to this [rad]; a motor that does not says nothing of the motion.
constexpr double kEvenness = 0.01;
/// A vehicle is not faster [m/s].
constexpr double kSpeedPrior = 40.0;

/// One point as its beam is seen from where the sensor is at utime.
struct Sample {
  float x;
  float y;
  float time_s;
  std::uint16_t ring;
};

struct Means {
  double count = 0.0;
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();  ///< Of (t, d azimuth / d velocity, residual).
};

/// Rate of the spin [rad/s] from neighbours of one ring: the median.
float spin_rate(const PointSweep& sweep, std::uint16_t ring) {
  std::vector<float> rates;
  const SweepPoint* previous = nullptr;
  const auto cx = static_cast<float>(sweep.sensor_position_m.x());
  const auto cy = static_cast<float>(sweep.sensor_position_m.y());
  for (const SweepPoint& point : sweep.points) {
    if (point.ring != ring) continue;
    if (previous != nullptr && point.time_s > previous->time_s) {
      const float change = std::remainder(fast_atan2(point.y_m - cy, point.x_m - cx) -
                                              fast_atan2(previous->y_m - cy, previous->x_m - cx),
                                          kTurn);
      if (std::isfinite(change)) rates.push_back(change / (point.time_s - previous->time_s));
    }
    previous = &point;
    if (rates.size() >= kRates) break;
  }
  if (rates.empty()) return 0.0F;
  const auto middle = rates.begin() + static_cast<std::ptrdiff_t>(rates.size() / 2);
  std::nth_element(rates.begin(), middle, rates.end());
  return *middle;
}

class SpinFit {
 public:
  explicit SpinFit(const PointSweep& sweep, double max_range_m) {
    const std::size_t stride = std::max<std::size_t>(1, sweep.points.size() / kSample);
    // Prime to the number of rings, so that every ring gets its share.
    const std::size_t step = stride + (stride % 2 == 0 ? 1 : 0);
    slope_sums_.assign(sweep.rings, {0.0F, 0.0F});
    for (std::size_t i = 0; i < sweep.points.size(); i += step) {
      const SweepPoint& point = sweep.points[i];
      if (point.ring >= sweep.rings) continue;
      const Eigen::Vector3f p = point.position() - sweep.sensor_position_m.cast<float>();
      const float range = std::sqrt(p.x() * p.x() + p.y() * p.y());
      if (!(range > 1.0F && range < static_cast<float>(max_range_m)) || !p.allFinite()) continue;
      samples_.push_back({p.x(), p.y(), point.time_s, point.ring});
      slope_sums_[point.ring].first += p.z() / range;
      slope_sums_[point.ring].second += 1.0F;
    }
  }

  std::vector<float> slopes() const {
    std::vector<float> result;
    for (const auto& [sum, count] : slope_sums_) {
      result.push_back(count > 0.0F ? sum / count : std::numeric_limits<float>::quiet_NaN());
    }
    return result;
  }

  Eigen::Vector2d velocity(float rate) {
    rate_ = rate;
    for (int round = 0; round < kRounds; ++round) improve();
    return residual_rms_ < kEvenness ? velocity_ : Eigen::Vector2d::Zero();
  }

 private:
  void improve() {
    const std::size_t rings = slope_sums_.size();
    std::vector<Means> means(rings);
    std::vector<float> offsets(rings, std::numeric_limits<float>::quiet_NaN());
    Eigen::Matrix4d sums = Eigen::Matrix4d::Zero();
    for (const Sample& sample : samples_) {
      const float x = sample.x - static_cast<float>(velocity_.x()) * sample.time_s;
      const float y = sample.y - static_cast<float>(velocity_.y()) * sample.time_s;
      const float range2 = x * x + y * y;
      const float turned = fast_atan2(y, x) - static_cast<float>(rate_) * sample.time_s;
      float& offset = offsets[sample.ring];
      if (std::isnan(offset)) offset = turned;
      const float residual = std::remainder(turned - offset, kTurn);
      // d azimuth / d velocity = time * (y, -x) / range^2.
      const Eigen::Vector4d row(sample.time_s, sample.time_s * y / range2,
                                -sample.time_s * x / range2, residual);
      Means& mean = means[sample.ring];
      mean.count += 1.0;
      mean.sum += row;
      sums += row * row.transpose();
    }
    double count = 1.0;
    for (const Means& mean : means) {
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

  std::vector<Sample> samples_;
  std::vector<std::pair<float, float>> slope_sums_;
  double rate_ = 0.0;
  Eigen::Vector2d velocity_ = Eigen::Vector2d::Zero();
  double residual_rms_ = std::numeric_limits<double>::infinity();
};

}  // namespace

Spin fit_spin(const PointSweep& sweep, double max_range_m,
              std::span<const std::size_t> points_per_ring) {
  SpinFit fit(sweep, max_range_m);
  Spin spin;
  spin.slopes = fit.slopes();
  if (!sweep.has_times || points_per_ring.empty()) return spin;
  const auto fullest = static_cast<std::uint16_t>(
      std::max_element(points_per_ring.begin(), points_per_ring.end()) - points_per_ring.begin());
  const float rate = spin_rate(sweep, fullest);
  if (rate != 0.0F) spin.velocity_mps = fit.velocity(rate).cast<float>();
  return spin;
}

}  // namespace understory
