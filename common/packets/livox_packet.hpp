// Headers and points of Livox's packets, of both of the maker's protocols.
//
// SDK2 (Mid-360, HAP): the Mid-360 communication protocol ("Point Cloud Data & IMU Data Protocol")
// and Livox-SDK2 (`livox_lidar_def.h`): a header of 36 bytes. SDK1 (Avia, Horizon, Mid-70): "Livox
// SDK Communication Protocol" V1.3, section 3, Livox-SDK (`livox_def.h`, LivoxEthPacket) and
// livox_ros_driver 2.6 (`lds.h`): a header of 18 bytes, a fixed number of points for each type.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <variant>

#include "common/packets/readings.hpp"

namespace understory::packets {

/// The supported models.
enum class LivoxModel : std::uint8_t { kMid360, kHap, kAvia, kHorizon, kMid70 };
/// By name: "mid360", "hap", "avia", "horizon", "mid70"; none for any other.
std::optional<LivoxModel> livox_model(std::string_view name);
/// The name for livox_model().
std::string_view to_string(LivoxModel model);
/// Whether it uses the SDK1 protocol. Such a laser sends only while one of the maker's programs is
/// connected, to ports that the two negotiate.
bool speaks_sdk1(LivoxModel model);

/// Properties of a model (user manuals; kLineNumber* of livox_ros_driver2,
/// product_type_info_pair_table of livox_ros_driver).
struct LivoxProperties {
  std::uint16_t lines = 0;
  double range_m = 0.0;
  double shots_per_s = 0.0;  ///< 0 for SDK2, whose packets state it.
};
/// Properties of a model with its default settings.
LivoxProperties livox_properties(LivoxModel model);

/// Layout of a shot in a packet.
struct LivoxShotLayout {
  /// Coordinates of its returns.
  enum class Coordinates : std::uint8_t { kMillimetres, kCentimetres, kSpherical };
  Coordinates coordinates = Coordinates::kMillimetres;
  std::size_t bytes = 0;
  std::size_t returns = 1;
};

/// Header values of a packet.
struct LivoxHeader {
  bool is_imu = false;
  std::size_t data_at = 0;
  std::size_t shots = 0;  ///< Number of shots.
  LivoxShotLayout layout;
  std::int64_t time_ns = 0;  ///< Time of the first shot or of the sample, sensor's clock.
  double span_ns = 0.0;      ///< Time from the first shot to that of the next packet.
  std::optional<std::uint16_t> number;  ///< SDK2: number of the packet; restarts with each frame.
};
/// The header, or the packet's fault. `received`: needed for an SDK1 laser with only a pulse per
/// second, which sends the time within the second.
std::variant<Fault, LivoxHeader> read_livox_header(LivoxModel model,
                                                   std::span<const std::uint8_t> bytes,
                                                   model::Utime received);

/// A return, in the laser's frame.
struct LivoxReturn {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< Zero without a return.
  std::uint8_t reflectivity = 0;
};
/// Reads one of the returns of a shot. Precondition: `shot` has the bytes of the layout.
LivoxReturn read_livox_return(std::span<const std::uint8_t> shot, const LivoxShotLayout& layout,
                              std::size_t which);

/// Whether the bytes are a complete and consistent point or IMU packet of the protocol.
bool is_livox_packet(std::span<const std::uint8_t> bytes);
bool is_livox_sdk1_packet(std::span<const std::uint8_t> bytes);

}  // namespace understory::packets
