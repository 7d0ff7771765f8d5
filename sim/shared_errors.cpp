#include "sim/shared_errors.hpp"

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "sim/hash_random.hpp"

namespace understory::sim {
namespace {

/// Sinusoids of a process along the path.
constexpr int kSinusoids = 24;

/// Purpose of a key.
enum class Purpose : std::uint64_t { kShape = 1, kAlong = 2, kLevel = 3, kMissed = 4 };

std::uint64_t key_of(std::uint64_t seed, Purpose purpose) {
  return mixed(seed, static_cast<std::uint64_t>(purpose));
}

/// Pair number `index` of standard normal numbers of `key`.
Eigen::Vector2d normal_pair(std::uint64_t key, std::uint64_t index) {
  return {normal_of(mixed(key, 2 * index)), normal_of(mixed(key, 2 * index + 1))};
}

/// Frequency times the correlation length: drawn from the density (1 - cos x) / (pi x^2), the
/// spectrum of a correlation that decreases linearly to 0 at distance 1 (rejection from min(1/2,
/// 2/x^2)).
double drawn_frequency(std::uint64_t key) {
  for (std::uint64_t i = 0;; ++i) {
    const double u = 1.0 - uniform_of(mixed(key, 3 * i));
    const bool is_low = uniform_of(mixed(key, 3 * i + 1)) < 0.5;
    const double x = is_low ? 2.0 * u : 2.0 / u;
    const double share = (1.0 - std::cos(x)) / (is_low ? 0.5 * x * x : 2.0);
    if (uniform_of(mixed(key, 3 * i + 2)) < share) return x;
  }
}

/// Two independent processes of unit variance and correlation max(0, 1 - d / length): sums of
/// sinusoids with Gaussian amplitudes, which are stationary (Rahimi & Recht 2007).
Eigen::Vector2d along_process(std::uint64_t key, double along_m, double length_m) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (std::uint64_t i = 0; i < kSinusoids; ++i) {
    const std::uint64_t sinusoid = mixed(key, i);
    const double phase = drawn_frequency(mixed(sinusoid)) * along_m / length_m;
    sum += std::cos(phase) * normal_pair(sinusoid, 0) + std::sin(phase) * normal_pair(sinusoid, 1);
  }
  return sum / std::sqrt(static_cast<double>(kSinusoids));
}

void check(const SharedErrorParameters& p) {
  if (p.along_sigma_m < 0.0 || p.direction_sigma_m < 0.0 || p.level_sigma_rad < 0.0)
    throw std::invalid_argument("shared errors: a sigma is negative");
  if (!(p.along_length_m > 0.0) || !(p.level_length_m > 0.0))
    throw std::invalid_argument("shared errors: a length of correlation is not positive");
  if (p.direction_harmonics < 1)
    throw std::invalid_argument("shared errors: less than one harmonic of the direction");
}

}  // namespace

bool SharedErrorParameters::any() const {
  return along_sigma_m > 0.0 || direction_sigma_m > 0.0 || radial_bias_share != 0.0 ||
         bearing_bias_rad != 0.0 || level_sigma_rad > 0.0 || missed_share > 0.0;
}

SharedErrorParameters measured_shared_errors() {
  SharedErrorParameters measured;
  measured.along_sigma_m = 0.047;
  measured.along_length_m = 9.5;
  measured.direction_sigma_m = 0.025;
  measured.radial_bias_share = -6e-4;
  return measured;
}

double measured_sigma_m() {
  const SharedErrorParameters measured = measured_shared_errors();
  return std::hypot(kMeasuredIndependentSigmaM, measured.along_sigma_m, measured.direction_sigma_m);
}

SharedErrors::SharedErrors(const SharedErrorParameters& parameters, std::uint64_t forest_seed,
                           std::uint64_t drive_seed)
    : parameters_(parameters),
      shapes_key_(key_of(forest_seed, Purpose::kShape)),
      drive_key_(mixed(drive_seed)) {
  check(parameters);
}

bool SharedErrors::is_missed(std::uint32_t landmark) const {
  return parameters_.missed_share > 0.0 && uniform_of(mixed(key_of(drive_key_, Purpose::kMissed),
                                                            landmark)) < parameters_.missed_share;
}

Eigen::Vector2d SharedErrors::error_m(std::uint32_t landmark, const Eigen::Vector2d& position_m,
                                      const geometry::SE2& world_T_vehicle, double along_m) const {
  const SharedErrorParameters& p = parameters_;
  Eigen::Vector2d in_world = Eigen::Vector2d::Zero();
  if (p.along_sigma_m > 0.0) {
    const std::uint64_t key = mixed(key_of(drive_key_, Purpose::kAlong), landmark);
    in_world += p.along_sigma_m * along_process(key, along_m, p.along_length_m);
  }
  if (p.direction_sigma_m > 0.0) {
    const Eigen::Vector2d away = world_T_vehicle.rotation() * position_m;
    in_world += by_direction(landmark, std::atan2(away.y(), away.x()));
  }
  return world_T_vehicle.rotation().transpose() * in_world + by_range_and_bearing(position_m) +
         level_error_m(along_m);
}

Eigen::Vector2d SharedErrors::level_error_m(double along_m) const {
  const SharedErrorParameters& p = parameters_;
  if (!(p.level_sigma_rad > 0.0)) return Eigen::Vector2d::Zero();
  const Eigen::Vector2d error_rad =
      p.level_sigma_rad *
      along_process(key_of(drive_key_, Purpose::kLevel), along_m, p.level_length_m);
  return model::level_arm(p.level_height_m) * error_rad;
}

Eigen::Vector2d SharedErrors::by_direction(std::uint32_t landmark, double direction_rad) const {
  const std::uint64_t key = mixed(shapes_key_, landmark);
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (int k = 1; k <= parameters_.direction_harmonics; ++k) {
    const auto index = 2 * static_cast<std::uint64_t>(k);
    sum += std::cos(k * direction_rad) * normal_pair(key, index) +
           std::sin(k * direction_rad) * normal_pair(key, index + 1);
  }
  return parameters_.direction_sigma_m /
         std::sqrt(static_cast<double>(parameters_.direction_harmonics)) * sum;
}

/// Range error along the direction to the landmark, bearing error across it.
Eigen::Vector2d SharedErrors::by_range_and_bearing(const Eigen::Vector2d& position_m) const {
  const double range_m = position_m.norm();
  if (!(range_m > 0.0)) return Eigen::Vector2d::Zero();
  const double bearing_error_rad = parameters_.bearing_bias_rad * position_m.y() / range_m;
  return parameters_.radial_bias_share * position_m +
         bearing_error_rad * geometry::perpendicular(position_m);
}

}  // namespace understory::sim
