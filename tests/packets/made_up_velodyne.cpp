// A VLP-16's packets after its manual (63-9243), one return.
#include <cmath>
#include <numbers>

#include "tests/packets/byte_writer.hpp"
#include "tests/packets/made_up_sensor.hpp"

namespace understory::test {
namespace {

constexpr double kRad = std::numbers::pi / 180.0;
constexpr double kFiring_us = 55.296;
constexpr double kShot_us = 2.304;
constexpr int kStep = 40;  // of the azimuth from block to block [0.01 degrees]

class VelodyneMaker {
 public:
  explicit VelodyneMaker(std::mt19937_64& random) : random_(random) {}

  MadeUpRecording record(int sweeps, model::Utime start) {
    MadeUpRecording recording;
    recording.sweeps.resize(static_cast<std::size_t>(sweeps));
    absolute_ = 36'000 - 50 * kStep;
    time_us_ = static_cast<double>(start);
    while (absolute_ < (sweeps + 1) * 36'000) add_packet(recording);
    return recording;
  }

 private:
  void add_packet(MadeUpRecording& recording) {
    ByteWriter packet(1206, random_);
    const auto packet_us = static_cast<std::int64_t>(time_us_);
    packet.put(1200, static_cast<std::uint32_t>(packet_us % 3'600'000'000));
    packet.put<std::uint8_t>(1204, 0x37);
    packet.put<std::uint8_t>(1205, 0x22);
    for (std::size_t block = 0; block < 12; ++block) {
      packet.put<std::uint16_t>(100 * block, 0xEEFF);
      packet.put(100 * block + 2, static_cast<std::uint16_t>(absolute_ % 36'000));
      for (std::size_t firing = 0; firing < 2; ++firing) {
        const double firing_us =
            static_cast<double>(packet_us) + static_cast<double>(2 * block + firing) * kFiring_us;
        for (std::size_t laser = 0; laser < 16; ++laser)
          add_shot(packet, 100 * block + 4 + 3 * (16 * firing + laser), firing, laser, firing_us,
                   recording);
      }
      absolute_ += kStep;
    }
    time_us_ += 24.0 * kFiring_us;
    recording.packets.push_back({packet.take(), static_cast<model::Utime>(time_us_) + 100, 2368});
  }

  void add_shot(ByteWriter& packet, std::size_t at, std::size_t firing, std::size_t laser,
                double firing_us, MadeUpRecording& recording) {
    const auto distance =
        static_cast<std::uint16_t>(random_() % 10 == 0 ? 0 : 500 + random_() % 20'000);
    const auto reflectivity = static_cast<std::uint8_t>(random_());
    packet.put(at, distance);
    packet.put(at + 2, reflectivity);
    const int sweep = absolute_ / 36'000 - 1;
    if (distance == 0 || sweep < 0 || sweep >= static_cast<int>(recording.sweeps.size())) return;

    const double after_us =
        static_cast<double>(firing) * kFiring_us + static_cast<double>(laser) * kShot_us;
    const double angle = 0.01 * kRad * (absolute_ % 36'000 + kStep * after_us / (2.0 * kFiring_us));
    const int ring = laser % 2 == 0 ? static_cast<int>(laser / 2) : static_cast<int>(8 + laser / 2);
    const double elevation = (2.0 * ring - 15.0) * kRad;
    const double range = 0.002 * distance;
    const double lift =
        io::velodyne_calibration(io::VelodyneModel::kVlp16).beams[laser].vertical_offset_m;
    const double flat = range * std::cos(elevation) - lift * std::sin(elevation);
    recording.sweeps[static_cast<std::size_t>(sweep)].push_back(
        {{flat * std::cos(angle), -flat * std::sin(angle),
          range * std::sin(elevation) + lift * std::cos(elevation)},
         std::llround(1e3 * (firing_us + static_cast<double>(laser) * kShot_us)),
         static_cast<std::uint16_t>(ring),
         reflectivity});
  }

  std::mt19937_64& random_;
  int absolute_ = 0;  ///< Azimuth since the start [0.01 degrees].
  double time_us_ = 0.0;
};

}  // namespace

std::vector<MadeUpSensor> made_up_velodynes() {
  MadeUpSensor sensor;
  sensor.name = "vlp16";
  sensor.description.model = "vlp16";
  // The decoder's table of sines has steps of 0.01 degrees: 3.6 mm at 41 m.
  sensor.tolerance_m = 4e-3;
  sensor.record = [](int sweeps, model::Utime start, std::mt19937_64& random) {
    return VelodyneMaker(random).record(sweeps, start);
  };
  return {sensor};
}

std::vector<MadeUpSensor> made_up_sensors() {
  std::vector<MadeUpSensor> all;
  for (const auto& family :
       {made_up_velodynes(), made_up_ousters(), made_up_livoxes(), made_up_hesais()})
    all.insert(all.end(), family.begin(), family.end());
  return all;
}

std::vector<MadeUpSensor> one_of_each_family() {
  return {made_up_velodynes().front(), made_up_ousters().front(), made_up_livoxes().front(),
          made_up_hesais().front()};
}

}  // namespace understory::test
