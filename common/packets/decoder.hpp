// One interface for the lasers of all makers: packets in, sweeps, IMU samples and fixes out.
//
// A family is a class with `Readings add(const Packet&)`, `std::optional<model::PointSweep>
// finish()` and `const StreamCounts& counts() const`; another family is another alternative here.
#pragma once

#include <concepts>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "common/packets/hesai_stream.hpp"
#include "common/packets/livox_stream.hpp"
#include "common/packets/ouster_stream.hpp"
#include "common/packets/velodyne_stream.hpp"

namespace understory::packets {

/// What a family's class can do.
template <class Family>
concept PacketStream = requires(Family& stream, const Family& seen, const Packet& packet) {
  { stream.add(packet) } -> std::same_as<Readings>;
  { stream.finish() } -> std::same_as<std::optional<model::PointSweep>>;
  { seen.counts() } -> std::same_as<const StreamCounts&>;
};

static_assert(PacketStream<VelodyneStream> && PacketStream<OusterStream> &&
              PacketStream<LivoxStream> && PacketStream<HesaiStream>);

/// A laser of any of the families.
using Decoder = std::variant<VelodyneStream, OusterStream, LivoxStream, HesaiStream>;

/// What this packet brought.
Readings add(Decoder& decoder, const Packet& packet);
/// The sweep under way, where it is almost whole.
std::optional<model::PointSweep> finish(Decoder& decoder);
/// Since the start.
const StreamCounts& counts(const Decoder& decoder);
/// How the sensor's clock was laid onto the computer's; null for Velodyne, which gives the hour's
/// microseconds only.
const SensorClock* clock(const Decoder& decoder);

/// Where the IMU inside of the laser sits, in frame `sensor` [m]; none where it has none or the
/// maker does not tell.
std::optional<Eigen::Vector3d> imu_position_m(const Decoder& decoder);

/// What is known of a sensor beside its packets.
struct SensorDescription {
  std::string model;            ///< A name that the families' *_model() take; "ouster".
  std::string description;      ///< Text of the file that the model needs or may have: Ouster's
                                ///< metadata, the HDL-64E's calibration, Hesai's angle correction.
  std::string source;           ///< That file's name, for messages.
  double max_range_m = 0.0;     ///< 0 = the model's.
  double livox_period_s = 0.1;  ///< Duration of a sweep where the pattern does not repeat.
};
/// All names that SensorDescription::model may have, comma separated.
std::string known_models();
/// Throws DataError where the model is not known, needs a file and has none, or cannot have one.
Decoder make_decoder(const SensorDescription& sensor);

}  // namespace understory::packets
