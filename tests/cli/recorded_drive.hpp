// A small recording in the Victoria Park set's format: a car drives an arc among trunks.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/io/victoria_park.hpp"
#include "tests/io/log_fixture.hpp"
#include "tests/landmark_extractor/simulated_sweep.hpp"

namespace understory::test {

/// 40 s at 3 m/s on an arc; frame `world` is the vehicle's at the first sweep. Wheels are exact,
/// ranges have 2 cm of noise.
class RecordedDrive {
 public:
  static constexpr std::size_t kScans = 200;
  static constexpr std::size_t kWheelSamples = 1601;
  static constexpr std::size_t kFixes = 41;

  RecordedDrive() {
    plant();
    write_wheels();
    write_laser();
    write_fixes();
  }

  std::string path() const { return directory_.path().string(); }
  const std::vector<Circle>& trunks() const { return trunks_; }

  /// world_T_vehicle; the axle rotates about a point to its left.
  static geometry::SE2 pose(double seconds) {
    const auto from_start = [](double s) {
      return geometry::SE2::Exp({kSpeed_mps * s, 0.0, kTurn_radps * s}) *
             io::victoria_park::axle_T_vehicle();
    };
    return from_start(kFirstScan_s).inverse() * from_start(seconds);
  }
  static double scan_time_s(std::size_t k) { return kFirstScan_s + 0.2 * static_cast<double>(k); }

  /// Distance of the nearest trunk [m].
  double to_trunk_m(const Eigen::Vector2d& position) const {
    double least = std::numeric_limits<double>::infinity();
    for (const auto& trunk : trunks_) least = std::min(least, (trunk.centre - position).norm());
    return least;
  }

 private:
  static constexpr double kFirstScan_s = 0.1;
  static constexpr double kSpeed_mps = 3.0;  // Of the middle of the rear axle.
  static constexpr double kTurn_radps = 0.05;

  /// Trunks 5 m or more apart and off the path.
  void plant() {
    std::uniform_real_distribution<double> x(-30.0, 110.0);
    std::uniform_real_distribution<double> y(-40.0, 130.0);
    std::uniform_real_distribution<double> radius(0.1, 0.25);
    for (int tries = 0; tries < 3000; ++tries) {
      const Eigen::Vector2d centre(x(random_), y(random_));
      bool is_free = to_trunk_m(centre) > 5.0;
      for (std::size_t k = 0; k < kScans; k += 4) {
        is_free = is_free && (pose(scan_time_s(k)).translation() - centre).norm() > 4.0;
      }
      if (is_free && trunks_.size() < 220) trunks_.push_back({centre, radius(random_)});
    }
  }

  void write_wheels() const {
    const double encoder_mps = kSpeed_mps - kTurn_radps * io::victoria_park::kEncoderLeft_m;
    const double steering = std::atan(io::victoria_park::kWheelbase_m * kTurn_radps / kSpeed_mps);
    std::ofstream file(directory_ / "DRS.txt");
    for (std::size_t i = 0; i < kWheelSamples; ++i) {
      file << fmt::format("{:.3f} {:.9f} {:.9f}\n", 0.025 * static_cast<double>(i), encoder_mps,
                          steering);
    }
  }

  void write_laser() {
    std::ofstream file(directory_ / "LASER.txt");
    for (std::size_t k = 0; k < kScans; ++k) {
      const geometry::SE2 vehicle_T_world = pose(scan_time_s(k)).inverse();
      std::vector<Circle> seen = trunks_;
      for (Circle& trunk : seen) trunk.centre = vehicle_T_world * trunk.centre;
      file << fmt::format("{:.3f}", scan_time_s(k));
      for (const float range : sweep(seen, {}, 0.02, random_).ranges_m) {
        file << fmt::format("\t{:.3f}", range);
      }
      file << '\t';
    }
  }

  void write_fixes() const {
    std::ofstream file(directory_ / "GPS.txt");
    for (std::size_t i = 0; i < kFixes; ++i) {
      const geometry::SE2 at = pose(static_cast<double>(i));
      file << fmt::format("{:.3f} {:.4f} {:.4f}\n", static_cast<double>(i), at.y(), at.x());
    }
  }

  TemporaryDirectory directory_;
  std::mt19937_64 random_{11};
  std::vector<Circle> trunks_;
};

}  // namespace understory::test
