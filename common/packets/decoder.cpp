#include "common/packets/decoder.hpp"

#include "common/io/data_error.hpp"

namespace understory::packets {
namespace {

io::VelodyneCalibration velodyne_calibration_of(io::VelodyneModel model,
                                                const SensorDescription& sensor) {
  const bool has_own = model == io::VelodyneModel::kHdl64e;
  if (!has_own && !sensor.description.empty())
    throw io::DataError(sensor.source + ": only an hdl64e has a calibration file");
  if (!has_own || sensor.description.empty()) return io::velodyne_calibration(model);
  return io::parse_hdl64_calibration(sensor.description, sensor.source);
}

std::vector<HesaiBeam> hesai_beams_of(HesaiModel model, const SensorDescription& sensor) {
  if (sensor.description.empty()) return hesai_beams(model);
  return parse_hesai_angles(sensor.description, model, sensor.source);
}

}  // namespace

Readings add(Decoder& decoder, const Packet& packet) {
  return std::visit([&](auto& stream) { return stream.add(packet); }, decoder);
}

std::optional<model::PointSweep> finish(Decoder& decoder) {
  return std::visit([](auto& stream) { return stream.finish(); }, decoder);
}

const StreamCounts& counts(const Decoder& decoder) {
  return std::visit([](const auto& stream) -> const StreamCounts& { return stream.counts(); },
                    decoder);
}

const SensorClock* clock(const Decoder& decoder) {
  return std::visit(
      [](const auto& stream) -> const SensorClock* {
        if constexpr (requires { stream.clock(); }) {
          return &stream.clock();
        } else {
          return nullptr;
        }
      },
      decoder);
}

std::optional<Eigen::Vector3d> imu_position_m(const Decoder& decoder) {
  return std::visit(
      [](const auto& stream) -> std::optional<Eigen::Vector3d> {
        if constexpr (requires { stream.imu_position_m(); }) {
          return stream.imu_position_m();
        } else {
          return std::nullopt;
        }
      },
      decoder);
}

std::string known_models() {
  return "vlp16, vlp32c, hdl32e, hdl64e, ouster, mid360, hap, avia, horizon, mid70, pandar40p, "
         "pandar64, pandarqt, xt16, xt32, xt32m2x";
}

Decoder make_decoder(const SensorDescription& sensor) {
  if (const auto velodyne = io::velodyne_model(sensor.model))
    return VelodyneStream(velodyne_calibration_of(*velodyne, sensor), sensor.max_range_m);
  if (sensor.model == "ouster") {
    if (sensor.description.empty())
      throw io::DataError(
          "the packets of an Ouster laser do not say where its beams point: its metadata (JSON) "
          "are wanted");
    return OusterStream(parse_ouster_metadata(sensor.description, sensor.source),
                        sensor.max_range_m);
  }
  if (const auto livox = livox_model(sensor.model)) {
    if (!sensor.description.empty())
      throw io::DataError(sensor.source + ": a Livox laser needs no file");
    return LivoxStream(*livox, sensor.livox_period_s, sensor.max_range_m);
  }
  if (const auto hesai = hesai_model(sensor.model))
    return HesaiStream(*hesai, hesai_beams_of(*hesai, sensor), sensor.max_range_m);
  throw io::DataError("\"" + sensor.model + "\" is none of " + known_models());
}

}  // namespace understory::packets
