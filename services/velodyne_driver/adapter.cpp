#include "services/velodyne_driver/adapter.hpp"

#include <memory>

#include "common/io/data_error.hpp"
#include "services/lidar_driver/driver_adapter.hpp"
#include "services/velodyne_driver/adapter_parameters.hpp"
#include "services/velodyne_driver/velodyne_driver.hpp"

namespace understory::velodyne_driver {
namespace {

io::VelodyneCalibration load_calibration(const VelodyneSensorParameters& sensor) {
  const io::VelodyneModel model = io::velodyne_model(sensor.model).value();
  const bool has_file = !sensor.calibration_file.empty();
  if (model == io::VelodyneModel::kHdl64e && !has_file)
    throw bus::ConfigurationError(
        {"sensor.calibration_file: an hdl64e needs its own XML or YAML file"});
  if (model != io::VelodyneModel::kHdl64e && has_file)
    throw bus::ConfigurationError(
        {"sensor.calibration_file: only an hdl64e has one, not a " + sensor.model});
  if (!has_file) return velodyne_calibration(model);
  const std::string text =
      lidar_driver::read_parameter_file("sensor.calibration_file", sensor.calibration_file);
  try {
    return io::parse_hdl64_calibration(text, sensor.calibration_file);
  } catch (const io::DataError& error) {
    throw bus::ConfigurationError({std::string("sensor.calibration_file: ") + error.what()});
  }
}

struct VelodyneFamily {
  using Parameters = VelodyneDriverParameters;
  using Stage = VelodyneDriver;

  static void describe(Parameters& parameters, bus::ParameterTable& table) {
    velodyne_driver::describe(parameters, table);
  }
  static lidar_driver::DriverSettings settings(const Parameters& p,
                                               const lidar_driver::DriverChannels& channels) {
    return {p.network,
            {{"data", p.ports.data, channels.sweep}, {"position", p.ports.position, channels.gnss}},
            p.range.silence_s,
            false,
            p.gnss.is_published};
  }
  static Stage make_stage(const Parameters& p) { return {p, load_calibration(p.sensor)}; }
};

}  // namespace

bus::Service velodyne_driver_service(const VelodyneDriverChannels& channels) {
  return {"velodyne_driver", channels.all, [channels] {
            return std::make_unique<lidar_driver::DriverAdapter<VelodyneFamily>>(
                lidar_driver::DriverChannels{channels.raw_sweep, "", channels.raw_gnss});
          }};
}

}  // namespace understory::velodyne_driver
