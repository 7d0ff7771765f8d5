// The metadata of an Ouster laser, needed to decode its packets.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace understory::packets {

/// Layout of range and reflectivity in a pixel (Ouster firmware manual, "Lidar Data Packet
/// Format").
enum class OusterPixel : std::uint8_t {
  kLegacy,
  kSingle,           ///< Range 19 bits, one return.
  kDual,             ///< Range 19 bits, two returns.
  kLowDataRate,      ///< Range 15 bits of 8 mm, one return.
  kLowDataRateDual,  ///< The same, two returns.
};

/// A layout of lidar packets: `udp_profile_lidar`.
struct OusterProfile {
  std::string_view name;
  OusterPixel pixel = OusterPixel::kLegacy;
  std::size_t pixel_bytes = 12;
  /// The frame's number has 32 bits, at another place in the header.
  bool has_safety_header = false;
};
/// All supported ones: LEGACY, RNG19_RFL8_SIG16_NIR16, RNG19_RFL8_SIG16_NIR16_DUAL,
/// RNG15_RFL8_NIR8, RNG15_RFL8_NIR8_DUAL, FUSA_RNG15_RFL8_NIR8_DUAL, and those with zones, windows
/// and five words.
std::span<const OusterProfile> ouster_profiles();
/// Profile by its name; none for any other.
std::optional<OusterProfile> ouster_profile(std::string_view name);

/// What the decoder needs of the metadata. Translations are in metres (the file has millimetres).
struct OusterMetadata {
  std::string product_line;  ///< "OS-1-64"; empty = not told.
  OusterProfile profile = {"LEGACY"};
  std::size_t columns_per_frame = 1024;
  std::size_t columns_per_packet = 16;
  std::size_t first_column = 0;  ///< The azimuth window; it may include column 0.
  std::size_t last_column = 1023;
  std::vector<double> altitude_rad;  ///< Elevation of each beam, upwards.
  std::vector<double>
      azimuth_rad;  ///< Azimuth of each beam relative to the encoder's angle, clockwise.
  /// Transform at encoder angle 0.
  Eigen::Isometry3d lidar_T_beam = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d sensor_T_lidar = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d sensor_T_imu = Eigen::Isometry3d::Identity();

  std::size_t beams() const { return altitude_rad.size(); }  ///< 16, 32, 64 or 128.
};

/// Reads both layouts: the flat one of firmware before 2.4 and of older clients, and the nested one
/// (`sensor_info`, `config_params`, `lidar_data_format`, `beam_intrinsics`, `lidar_intrinsics`,
/// `imu_intrinsics`). Missing values have the maker's default (ouster-sdk, `metadata.cpp` and
/// `types.cpp`), except beam angles and the number of columns. Throws DataError with `source` and
/// the field.
OusterMetadata parse_ouster_metadata(std::string_view text, const std::string& source);

}  // namespace understory::packets
