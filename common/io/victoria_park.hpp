// The Victoria Park recording (J. Guivant, J. Nieto, E. Nebot, ACFR, University of Sydney): a car
// with a laser that sweeps a plane, an encoder on a rear wheel, a steering sensor and GPS, driven
// among trees.
//
// Input is the published victoria_park_ascii.zip, or a folder with its LASER.txt, DRS.txt and
// GPS.txt. Times become microseconds from the recording's first GPS fix.
#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/model/gnss.hpp"
#include "common/model/planar_scan.hpp"
#include "common/model/wheels.hpp"

namespace understory::io {

/// The whole recording, each sensor in order of time.
struct VictoriaPark {
  std::vector<model::PlanarScan> scans;  ///< 7230, every 0.214 s; frame `sensor` (the laser).
  std::vector<model::WheelSample>
      wheels;                        ///< 61763, every 0.025 s; encoder on the rear left wheel.
  std::vector<model::GnssFix> gnss;  ///< 948 fixes; the authors removed bad ones.
};

namespace victoria_park {

constexpr std::size_t kBeams = 361;    ///< 0.5 degrees apart, from the right to the left.
constexpr double kMaxRange_m = 80.0;   ///< A greater reading means "no return".
constexpr double kWheelbase_m = 2.83;  ///< [L]
/// [H] Offset of the encoder's wheel to the left of the middle.
constexpr double kEncoderLeft_m = 0.76;
constexpr double kLaserAhead_m = 3.78;  ///< [L + a] Distance ahead of the rear axle.
constexpr double kLaserLeft_m = 0.5;    ///< [b] Offset to the left of the middle of the car.

/// Frame `vehicle` of this recording: the laser, x forward, relative to the middle of the rear
/// axle. A scan's field of view is a sector around the vehicle, so the vehicle's origin is the
/// laser.
inline geometry::SE2 axle_T_vehicle() {
  return {victoria_park::kLaserAhead_m, victoria_park::kLaserLeft_m, 0.0};
}

/// Scans from the text of LASER.txt; `source` names it in errors. Throws DataError.
std::vector<model::PlanarScan> parse_laser(std::string_view text, std::string_view source);
/// Speeds and steering angles from the text of DRS.txt. Throws DataError.
std::vector<model::WheelSample> parse_wheels(std::string_view text, std::string_view source);
/// Fixes from the text of GPS.txt. Throws DataError.
std::vector<model::GnssFix> parse_gnss(std::string_view text, std::string_view source);

}  // namespace victoria_park

/// Reads the whole set from a folder or zip archive. Throws DataError.
VictoriaPark read_victoria_park(const std::filesystem::path& path);

}  // namespace understory::io
