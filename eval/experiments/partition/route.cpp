#include "eval/experiments/partition/route.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "eval/harness/block.hpp"

namespace understory::eval::experiments::partition {
namespace {

constexpr double kStep_m = 1.6;  // between keyframes, as eight scans of 0.2 m
constexpr model::Utime kStep_us = 800'000;
constexpr std::uint16_t kScans = 8;
constexpr double kTile_m = 20.0;
/// No landmark this near to the path.
constexpr double kClear_m = 1.5;
/// Corners of a block are arcs.
constexpr double kCorner_m = 12.0;
/// The road's heading: amplitudes [rad] and wave lengths [m].
constexpr std::array<std::pair<double, double>, 4> kWaves{
    std::pair{0.5, 1700.0}, {0.3, 530.0}, {0.2, 190.0}, {0.1, 67.0}};

std::uint64_t mixed(std::uint64_t seed, int x, int y) {
  std::uint64_t bits = seed * 0x9E3779B97F4A7C15ULL;
  for (const int part : {x, y}) {
    bits ^= static_cast<std::uint32_t>(part);
    bits *= 0xBF58476D1CE4E5B9ULL;
    bits ^= bits >> 29U;
  }
  return bits;
}

}  // namespace

Route::Route(const RouteParameters& parameters, std::uint64_t seed)
    : parameters_(parameters),
      seed_(seed),
      size_(static_cast<std::size_t>(parameters.length_m / kStep_m) + 1),
      random_(seed) {
  std::uniform_real_distribution<double> phase(0.0, 2.0 * std::numbers::pi);
  for (std::size_t i = 0; i < kWaves.size(); ++i) phases_.push_back(phase(random_));

  // The road's heading is integrated.
  geometry::SE2 road(0.0, 0.0, heading_of_road(0.0));
  const geometry::SE2 start = road.inverse();
  poses_.reserve(size_);
  for (std::size_t k = 0; k < size_; ++k) {
    if (parameters.block_m > 0.0) {
      poses_.push_back(on_block(0.0).inverse() * on_block(along_m(k)));
      continue;
    }
    poses_.push_back(start * road);
    const double turn = heading_of_road(along_m(k + 1)) - road.theta();
    road = road * geometry::SE2::Exp({kStep_m, 0.0, geometry::wrap_angle(turn)});
  }
}

double Route::along_m(std::size_t k) { return kStep_m * static_cast<double>(k); }

std::size_t Route::number_of(model::Utime utime) {
  return static_cast<std::size_t>(utime / kStep_us) - 1;
}

geometry::SE2 Route::pose(std::size_t k) const { return poses_[k]; }

double Route::heading_of_road(double along_m) const {
  double heading = 0.0;
  for (std::size_t i = 0; i < kWaves.size(); ++i) {
    const auto& [amplitude, wave_m] = kWaves[i];
    heading += amplitude * std::sin(2.0 * std::numbers::pi * along_m / wave_m + phases_[i]);
  }
  return heading;
}

/// A rectangle, twice as long as wide, with round corners.
geometry::SE2 Route::on_block(double along_m) const {
  const double arcs_m = 2.0 * std::numbers::pi * kCorner_m;
  const double straight_m = (parameters_.block_m - arcs_m) / 6.0;
  return harness::on_block(along_m, {2.0 * straight_m, straight_m}, kCorner_m);
}

std::vector<Eigen::Vector2d> Route::tile(int x, int y) const {
  std::mt19937_64 random(mixed(seed_, x, y));
  std::poisson_distribution<int> count(parameters_.landmarks_per_km2 * 1e-6 * kTile_m * kTile_m);
  std::uniform_real_distribution<double> place(0.0, kTile_m);
  std::vector<Eigen::Vector2d> landmarks(static_cast<std::size_t>(count(random)));
  for (Eigen::Vector2d& one : landmarks)
    one = Eigen::Vector2d(x * kTile_m + place(random), y * kTile_m + place(random));
  return landmarks;
}

model::Keyframe Route::keyframe(std::size_t k) {
  model::Keyframe out;
  out.utime = static_cast<model::Utime>(k + 1) * kStep_us;
  out.sequence = k + 1;
  out.field_of_view.max_range_m = parameters_.range_m;
  out.members.push_back({out.utime, out.sequence, {}, 1e-10 * Eigen::Matrix3d::Identity()});

  const geometry::SE2& here = poses_[k];
  const geometry::SE2 here_T_world = here.inverse();
  const auto cell = [](double x_m) { return static_cast<int>(std::floor(x_m / kTile_m)); };
  std::uniform_real_distribution<double> chance(0.0, 1.0);
  const double sigma = parameters_.sigma_m;
  for (int x = cell(here.x() - parameters_.range_m); x <= cell(here.x() + parameters_.range_m);
       ++x) {
    for (int y = cell(here.y() - parameters_.range_m); y <= cell(here.y() + parameters_.range_m);
         ++y) {
      for (const Eigen::Vector2d& trunk : tile(x, y)) {
        const Eigen::Vector2d local = here_T_world * trunk;
        if (local.norm() > parameters_.range_m || local.norm() < kClear_m ||
            chance(random_) > parameters_.detection) {
          continue;
        }
        model::KeyframeLandmark landmark;
        landmark.position_m = local + sigma * Eigen::Vector2d(unit(), unit());
        landmark.covariance_m2 = sigma * sigma * Eigen::Matrix2d::Identity();
        landmark.radius_m = 0.15;
        landmark.observation_count = kScans;
        out.landmarks.push_back(landmark);
      }
    }
  }
  return out;
}

model::Odometry Route::odometry(std::size_t k) {
  const double translation_m = parameters_.odometry_share * kStep_m;
  const double heading_rad = parameters_.odometry_heading_deg * std::numbers::pi / 180.0;
  const Eigen::Vector3d sigma(translation_m, 0.2 * translation_m, heading_rad);
  model::Odometry out;
  out.from_utime = static_cast<model::Utime>(k) * kStep_us;
  out.utime = out.from_utime + kStep_us;
  out.sequence = k;
  const Eigen::Vector3d noise = sigma.cwiseProduct(Eigen::Vector3d(unit(), unit(), unit()));
  out.from_T_to = poses_[k - 1].inverse() * poses_[k] * geometry::SE2::Exp(noise);
  out.covariance = sigma.array().square().matrix().asDiagonal();
  out.has_wheels = true;
  return out;
}

}  // namespace understory::eval::experiments::partition
