// Livox's packets after its SDK2 and SDK1 protocols.
#include <chrono>
#include <cmath>
#include <numbers>

#include "tests/packets/byte_writer.hpp"
#include "tests/packets/made_up_sensor.hpp"

namespace understory::test {
namespace {

constexpr double kTurn_rad = 2.0 * std::numbers::pi;

double in_range(double from, double to, std::mt19937_64& random) {
  return std::uniform_real_distribution<double>(from, to)(random);
}

/// Sends 96 points every 480 us, and IMU samples in between.
class LivoxMaker {
 public:
  LivoxMaker(packets::LivoxModel model, std::uint8_t type, std::mt19937_64& random)
      : model_(model), type_(type), random_(random) {}

  MadeUpRecording record(int sweeps, model::Utime start) {
    constexpr std::int64_t kPeriod_ns = 100'000'000;
    MadeUpRecording recording;
    time_ns_ = (start * 1000 / kPeriod_ns + 1) * kPeriod_ns - 5'000'000;
    first_ns_ = time_ns_ + 5'000'000;
    recording.sweeps.resize(static_cast<std::size_t>(sweeps));
    while (time_ns_ < first_ns_ + sweeps * kPeriod_ns) {
      add_packet(recording);
      if (random_() % 10 == 0) add_imu(recording);
    }
    return recording;
  }

 private:
  ByteWriter begin(std::uint8_t type, std::size_t points, std::size_t data) {
    ByteWriter packet(36 + data, random_);
    packet.put<std::uint8_t>(0, 0);
    packet.put(1, static_cast<std::uint16_t>(36 + data));
    packet.put<std::uint16_t>(3, 4800);  // 480 us
    packet.put(5, static_cast<std::uint16_t>(points));
    packet.put(7, number_++);
    packet.put(10, type);
    packet.put<std::uint8_t>(11, 1);  // gPTP
    packet.put(28, time_ns_);
    return packet;
  }

  void add_packet(MadeUpRecording& recording) {
    constexpr std::size_t kPoints = 96;
    constexpr std::size_t kBytes[] = {0, 14, 8, 10};
    const std::size_t each = kBytes[type_];
    ByteWriter packet = begin(type_, kPoints, kPoints * each);
    for (std::size_t i = 0; i < kPoints; ++i) {
      const std::int64_t point_ns = time_ns_ + 5000 * static_cast<std::int64_t>(i);
      const bool is_missing = random_() % 10 == 0;
      const auto reflectivity = static_cast<std::uint8_t>(random_());
      const Eigen::Vector3d position = put_point(packet, 36 + i * each, is_missing, reflectivity);
      const std::int64_t sweep = (point_ns - first_ns_) / 100'000'000;
      if (is_missing || point_ns < first_ns_ ||
          sweep >= static_cast<std::int64_t>(recording.sweeps.size()))
        continue;
      const std::uint16_t lines = model_ == packets::LivoxModel::kHap ? 6 : 4;
      recording.sweeps[static_cast<std::size_t>(sweep)].push_back(
          {position, point_ns, static_cast<std::uint16_t>(i % lines), reflectivity});
    }
    time_ns_ += 480'000;
    recording.packets.push_back({packet.take(), time_ns_ / 1000, livox_ports(model_).points});
  }

  Eigen::Vector3d put_point(ByteWriter& packet, std::size_t at, bool is_missing,
                            std::uint8_t reflectivity) {
    const double range = is_missing ? 0.0 : in_range(0.5, 50.0, random_);
    const double theta = in_range(0.6, 1.7, random_);
    const double phi = in_range(0.0, kTurn_rad, random_);
    const Eigen::Vector3d p(range * std::sin(theta) * std::cos(phi),
                            range * std::sin(theta) * std::sin(phi), range * std::cos(theta));
    if (type_ == 3) {
      const auto depth_mm = static_cast<std::uint32_t>(std::lround(range * 1e3));
      const auto zenith = static_cast<std::uint16_t>(std::lround(theta * 36000.0 / kTurn_rad));
      const auto azimuth = static_cast<std::uint16_t>(std::lround(phi * 36000.0 / kTurn_rad));
      packet.put(at, depth_mm);
      packet.put(at + 4, zenith);
      packet.put(at + 6, azimuth);
      packet.put(at + 8, reflectivity);
      return p;
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double value = p[static_cast<int>(axis)];
      if (type_ == 1)
        packet.put(at + 4 * axis, static_cast<std::int32_t>(std::lround(1e3 * value)));
      if (type_ == 2)
        packet.put(at + 2 * axis, static_cast<std::int16_t>(std::lround(1e2 * value)));
    }
    packet.put(at + (type_ == 1 ? 12 : 6), reflectivity);
    return p;
  }

  void add_imu(MadeUpRecording& recording) {
    ByteWriter packet = begin(0, 1, 24);
    --number_;  // IMU packets have a count of their own
    model::ImuSample sample;
    sample.utime = time_ns_ / 1000;
    sample.sequence = recording.imu.size();
    for (int axis = 0; axis < 3; ++axis) {
      const auto rad_s = static_cast<float>(in_range(-1.0, 1.0, random_));
      const auto g = static_cast<float>(in_range(-2.0, 2.0, random_));
      const auto at = 36 + 4 * static_cast<std::size_t>(axis);
      packet.put(at, rad_s);
      packet.put(at + 12, g);
      sample.angular_rate_rad_s[axis] = rad_s;
      sample.specific_force_mps2[axis] = 9.80665 * static_cast<double>(g);
    }
    recording.imu.push_back(sample);
    recording.packets.push_back({packet.take(), time_ns_ / 1000, livox_ports(model_).imu});
  }

  packets::LivoxModel model_;
  std::uint8_t type_;
  std::mt19937_64& random_;
  std::int64_t time_ns_ = 0;
  std::int64_t first_ns_ = 0;
  std::uint16_t number_ = 60'000;
};

/// Sends packets of the SDK1 protocol, and IMU samples in between.
class LivoxSdk1Maker {
 public:
  LivoxSdk1Maker(packets::LivoxModel model, std::uint8_t type, std::uint8_t clock,
                 std::mt19937_64& random)
      : properties_(livox_properties(model)), type_(type), clock_(clock), random_(random) {}

  MadeUpRecording record(int sweeps, model::Utime start) {
    constexpr std::int64_t kPeriod_ns = 100'000'000;
    MadeUpRecording recording;
    begin_ns_ = (start * 1000 / kPeriod_ns + 1) * kPeriod_ns - 5'000'000;
    first_ns_ = begin_ns_ + 5'000'000;
    recording.sweeps.resize(static_cast<std::size_t>(sweeps));
    while (time_ns() < first_ns_ + sweeps * kPeriod_ns) {
      add_packet(recording);
      if (properties_.lines > 1 && random_() % 10 == 0) add_imu(recording);
    }
    return recording;
  }

 private:
  static constexpr std::size_t kHeader = 18;
  /// Whole microseconds, as a packet by UTC has them.
  std::int64_t time_ns() const {
    return begin_ns_ +
           1000 * std::llround(1e6 * static_cast<double>(shots_) / properties_.shots_per_s);
  }

  ByteWriter begin(std::uint8_t type, std::size_t data) {
    ByteWriter packet(kHeader + data, random_);
    packet.put(8, clock_);
    packet.put(9, type);
    if (clock_ != 3) {
      packet.put(10, clock_ == 4 ? time_ns() % 1'000'000'000 : time_ns());
      return packet;
    }
    const std::int64_t micros = time_ns() / 1000;
    constexpr std::int64_t kHour_us = 3'600'000'000;
    const std::chrono::sys_days days{
        std::chrono::floor<std::chrono::days>(std::chrono::microseconds(micros))};
    const std::chrono::year_month_day day{days};
    packet.put(10, static_cast<std::uint8_t>(static_cast<int>(day.year()) - 2000));
    packet.put(11, static_cast<std::uint8_t>(static_cast<unsigned>(day.month())));
    packet.put(12, static_cast<std::uint8_t>(static_cast<unsigned>(day.day())));
    packet.put(13, static_cast<std::uint8_t>(micros / kHour_us % 24));
    packet.put(14, static_cast<std::uint32_t>(micros % kHour_us));
    return packet;
  }

  void add_packet(MadeUpRecording& recording) {
    constexpr std::size_t kShots[] = {100, 100, 96, 96, 48, 48, 0, 30, 30};
    constexpr std::size_t kBytes[] = {13, 9, 14, 10, 28, 16, 0, 42, 22};
    constexpr std::size_t kReturns[] = {1, 1, 1, 1, 2, 2, 0, 3, 3};
    const std::size_t each = kBytes[type_];
    ByteWriter packet = begin(type_, kShots[type_] * each);
    for (std::size_t i = 0; i < kShots[type_]; ++i) {
      const std::int64_t shot_ns =
          time_ns() + std::llround(1e9 * static_cast<double>(i) / properties_.shots_per_s);
      const double theta = in_range(0.6, 1.7, random_);
      const double phi = in_range(0.0, kTurn_rad, random_);
      for (std::size_t k = 0; k < kReturns[type_]; ++k) {
        const bool is_missing = random_() % 10 == 0;
        const double range = is_missing ? 0.0 : in_range(0.5, 50.0, random_);
        const auto reflectivity = static_cast<std::uint8_t>(random_());
        const Eigen::Vector3d p =
            put_return(packet, kHeader + i * each, k, range, theta, phi, reflectivity);
        const std::int64_t sweep = (shot_ns - first_ns_) / 100'000'000;
        if (is_missing || shot_ns < first_ns_ ||
            sweep >= static_cast<std::int64_t>(recording.sweeps.size()))
          continue;
        recording.sweeps[static_cast<std::size_t>(sweep)].push_back(
            {p, shot_ns, static_cast<std::uint16_t>(i % properties_.lines), reflectivity});
      }
    }
    shots_ += kShots[type_];
    recording.packets.push_back({packet.take(), time_ns() / 1000, 60001});
  }

  Eigen::Vector3d put_return(ByteWriter& packet, std::size_t at, std::size_t which, double range,
                             double theta, double phi, std::uint8_t reflectivity) const {
    const Eigen::Vector3d p(range * std::sin(theta) * std::cos(phi),
                            range * std::sin(theta) * std::sin(phi), range * std::cos(theta));
    const bool is_spherical = type_ == 1 || type_ == 3 || type_ == 5 || type_ == 8;
    if (!is_spherical) {
      for (std::size_t axis = 0; axis < 3; ++axis)
        packet.put(at + 14 * which + 4 * axis,
                   static_cast<std::int32_t>(std::lround(1e3 * p[static_cast<int>(axis)])));
      packet.put(at + 14 * which + 12, reflectivity);
      return p;
    }
    const auto depth_mm = static_cast<std::uint32_t>(std::lround(range * 1e3));
    const auto zenith = static_cast<std::uint16_t>(std::lround(theta * 36000.0 / kTurn_rad));
    const auto azimuth = static_cast<std::uint16_t>(std::lround(phi * 36000.0 / kTurn_rad));
    const bool is_single = type_ < 4;
    packet.put(at + (is_single ? 0 : 4 + 6 * which), depth_mm);
    packet.put(at + (is_single ? 4 : 0), zenith);
    packet.put(at + (is_single ? 6 : 2), azimuth);
    packet.put(at + (is_single ? 8 : 8 + 6 * which), reflectivity);
    return p;
  }

  void add_imu(MadeUpRecording& recording) {
    ByteWriter packet = begin(6, 24);
    model::ImuSample sample;
    sample.utime = time_ns() / 1000;
    sample.sequence = recording.imu.size();
    for (int axis = 0; axis < 3; ++axis) {
      const auto rad_s = static_cast<float>(in_range(-1.0, 1.0, random_));
      const auto g = static_cast<float>(in_range(-2.0, 2.0, random_));
      const auto at = kHeader + 4 * static_cast<std::size_t>(axis);
      packet.put(at, rad_s);
      packet.put(at + 12, g);
      sample.angular_rate_rad_s[axis] = rad_s;
      sample.specific_force_mps2[axis] = 9.80665 * static_cast<double>(g);
    }
    recording.imu.push_back(sample);
    recording.packets.push_back({packet.take(), time_ns() / 1000, 60002});
  }

  packets::LivoxProperties properties_;
  std::uint8_t type_;
  std::uint8_t clock_;  ///< 0 or 1: a count of nanoseconds; 3: UTC; 4: since the pulse.
  std::mt19937_64& random_;
  std::int64_t begin_ns_ = 0;
  std::int64_t first_ns_ = 0;
  std::size_t shots_ = 0;
};

/// Every data type that a model has, and every clock.
std::vector<MadeUpSensor> sdk1_sensors() {
  struct Mode {
    packets::LivoxModel model;
    std::uint8_t type;
    std::uint8_t clock;
  };
  std::vector<MadeUpSensor> sensors;
  for (const Mode mode : std::vector<Mode>{{packets::LivoxModel::kMid70, 0, 1},
                                           {packets::LivoxModel::kMid70, 1, 4},
                                           {packets::LivoxModel::kMid70, 2, 3},
                                           {packets::LivoxModel::kHorizon, 2, 1},
                                           {packets::LivoxModel::kHorizon, 4, 4},
                                           {packets::LivoxModel::kAvia, 2, 3},
                                           {packets::LivoxModel::kAvia, 3, 1},
                                           {packets::LivoxModel::kAvia, 5, 1},
                                           {packets::LivoxModel::kAvia, 7, 1},
                                           {packets::LivoxModel::kAvia, 8, 1}}) {
    MadeUpSensor sensor;
    sensor.name = std::string(to_string(mode.model)) + " data type " + std::to_string(mode.type) +
                  " clock " + std::to_string(mode.clock);
    sensor.description.model = to_string(mode.model);
    const bool is_spherical = mode.type % 2 == 1 && mode.type != 7;
    sensor.tolerance_m = is_spherical || mode.type == 8 ? 7e-3 : 0.9e-3;
    sensor.record = [mode](int sweeps, model::Utime start, std::mt19937_64& random) {
      return LivoxSdk1Maker(mode.model, mode.type, mode.clock, random).record(sweeps, start);
    };
    sensors.push_back(sensor);
  }
  return sensors;
}

}  // namespace

std::vector<MadeUpSensor> made_up_livoxes() {
  std::vector<MadeUpSensor> sensors;
  for (const auto model : {packets::LivoxModel::kMid360, packets::LivoxModel::kHap}) {
    for (const std::uint8_t type : {std::uint8_t{1}, std::uint8_t{2}, std::uint8_t{3}}) {
      MadeUpSensor sensor;
      sensor.name = std::string(to_string(model)) + " data type " + std::to_string(type);
      sensor.description.model = to_string(model);
      // Half a millimetre or centimetre along each axis; half a hundredth of a degree at 50 m.
      constexpr double kTolerance_m[] = {0.0, 0.9e-3, 0.9e-2, 7e-3};
      sensor.tolerance_m = kTolerance_m[type];
      sensor.record = [model, type](int sweeps, model::Utime start, std::mt19937_64& random) {
        return LivoxMaker(model, type, random).record(sweeps, start);
      };
      sensors.push_back(sensor);
    }
  }
  for (const MadeUpSensor& sensor : sdk1_sensors()) sensors.push_back(sensor);
  return sensors;
}

}  // namespace understory::test
