// Simulated drives with real sensors, converted to messages.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/wire/convert.hpp"
#include "sim/scenarios.hpp"
#include "understory/truth_landmarks_t.hpp"

namespace understory::cli {

/// The options of `understory sim` with sensors.
struct SensorSimulationOptions {
  std::string world;  ///< See is_sensor_world.
  std::string forest = "intermediate";
  std::string path = "circle";
  double length_m = 1000.0;  ///< For forest and countryside; the block has its own.
  int laps = 1;              ///< For forest and block.
  std::string lidar = "vlp32";
  bool planar_laser = false;
  double planar_revolution_s = 0.1;  ///< 0 = all beams at one instant.
  double speed_mps = 5.0;
  double standstill_s = 22.0;
  std::optional<double> gnss_outage_from_s;  ///< The outage lasts until the end of the drive.
  std::uint64_t seed = 1;
};

/// Whether the name is a world with sensors: one of sensor_worlds(), or
/// poles:POLES.csv,TRAJECTORY.csv
bool is_sensor_world(std::string_view world);
/// The names of worlds with sensors.
std::vector<std::string> sensor_worlds();
/// The names of lasers, "none" among them.
std::vector<std::string> lidar_names();

/// The drive described by the options. Fails (see failure.hpp) where a name is unknown or a file
/// cannot be read.
sim::SensorDrive make_sensor_drive(const SensorSimulationOptions& options);

/// Output of messages: the bus or a log.
using Publish =
    std::function<void(const std::string& channel, model::Utime utime, const wire::Bytes& bytes)>;

/// Converts readings to messages: RAW_SWEEP (in parts), RAW_SCAN, RAW_IMU, RAW_WHEELS, RAW_GNSS,
/// GROUND_TRUTH.
class SensorPublisher {
 public:
  /// Sends through `publish`. `utime_of_start` is added to the stamps of the readings.
  explicit SensorPublisher(Publish publish, model::Utime utime_of_start = 0)
      : publish_(std::move(publish)), utime_of_start_(utime_of_start) {}
  /// Sends one reading.
  void publish(const sim::SensorReading& reading);

 private:
  Publish publish_;
  model::Utime utime_of_start_;
  std::uint64_t sweep_parts_ = 0;
};

/// Time at which a reading is complete and can be sent [us].
model::Utime complete_at(const sim::SensorReading& reading, const sim::SensorDrive& drive);

/// Sends every reading in the order in which real sensors would give it, true landmarks first.
/// `wait_until` is called before each with the time of the drive at which it is complete.
/// `utime_of_start` is added to the stamps of all messages. Throws terminal::Interrupted.
void send_readings(sim::SensorDrive& drive, const Publish& publish,
                   const std::function<void(model::Utime)>& wait_until,
                   model::Utime utime_of_start = 0);
/// The whole drive as a log, written whole or not at all. `progress` gets the simulated time [s].
/// Throws io::LogError, terminal::Interrupted.
void write_sensor_log(sim::SensorDrive& drive, const std::string& file,
                      const std::function<void(double)>& progress);

/// Trunks, poles and corners within 40 m of the path, which a map can contain. Ids number trunks
/// first.
truth_landmarks_t true_landmarks_on_path(const sim::SensorDrive& drive);

}  // namespace understory::cli
