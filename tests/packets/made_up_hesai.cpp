// Hesai's packets after its manuals; angles and firing times are the makers' tables.
#include <chrono>
#include <cmath>
#include <numbers>

#include "tests/packets/byte_writer.hpp"
#include "tests/packets/made_up_sensor.hpp"

namespace understory::test {
namespace {

using packets::HesaiModel;

constexpr double kDegree = std::numbers::pi / 180.0;

/// A model as its manual describes it.
struct Sheet {
  HesaiModel model;
  std::size_t blocks, beams, channel_bytes;
  std::size_t header_bytes;  ///< 0: each block begins with 0xFFEE.
  double block_us;           ///< From firing to firing.
  double start_us;           ///< Of the last block (QT: the first one) after the packet's time.
  int step;                  ///< Of the azimuth in that time, 10 Hz [0.01 degrees].
};

constexpr Sheet kSheets[] = {
    {HesaiModel::kPandar40p, 10, 40, 3, 0, 55.56, -28.58, 20},
    {HesaiModel::kPandar64, 6, 64, 3, 8, 55.56, -42.58, 20},
    {HesaiModel::kPandarQt, 4, 64, 4, 12, 166.67, 35.71, 60},
    {HesaiModel::kPandarXt16, 8, 16, 4, 12, 50.0, 5.632, 18},
    {HesaiModel::kPandarXt32, 8, 32, 4, 12, 50.0, 5.632, 18},
    {HesaiModel::kXt32m2x, 6, 32, 4, 12, 50.0, 5.632, 18},
};

class HesaiMaker {
 public:
  HesaiMaker(const Sheet& sheet, std::size_t returns, std::vector<packets::HesaiBeam> beams,
             std::mt19937_64& random)
      : sheet_(sheet), returns_(returns), beams_(std::move(beams)), random_(random) {}

  MadeUpRecording record(int sweeps, model::Utime start) {
    constexpr int kTurn = 36'000;
    MadeUpRecording recording;
    recording.sweeps.resize(static_cast<std::size_t>(sweeps));
    unit_mm_ = sheet_.header_bytes == 0 ? 4 : static_cast<std::uint8_t>(3 + random_() % 3);
    has_sequence_ = random_() % 2 == 0;
    absolute_ = kTurn - 100 * sheet_.step;
    start_us_ = static_cast<double>(start);
    while (absolute_ < (sweeps + 1) * kTurn) add_packet(recording);
    return recording;
  }

 private:
  std::size_t block_bytes() const {
    return (sheet_.header_bytes == 0 ? 4 : 2) + sheet_.beams * sheet_.channel_bytes;
  }

  void add_packet(MadeUpRecording& recording) {
    const bool is_old = sheet_.header_bytes < 12;
    const std::size_t tail = sheet_.header_bytes + sheet_.blocks * block_bytes();
    ByteWriter packet(tail + (is_old ? 22U : 24U) + (has_sequence_ ? 4U : 0U), random_);
    put_header(packet);

    const std::size_t firings = sheet_.blocks / returns_;
    const bool is_qt = sheet_.model == HesaiModel::kPandarQt;
    // The packet's time is whole microseconds; the firings follow from it.
    const double from_us = start_us_ + static_cast<double>(fired_) * sheet_.block_us;
    const double last_us = from_us + static_cast<double>(firings - 1) * sheet_.block_us;
    const auto time_us =
        static_cast<std::int64_t>(std::llround((is_qt ? from_us : last_us) - sheet_.start_us));
    put_time(packet, tail, time_us);
    for (std::size_t f = 0; f < firings; ++f) {
      const double from_time =
          static_cast<double>(f) - (is_qt ? 0.0 : static_cast<double>(firings - 1));
      const std::int64_t firing_ns =
          time_us * 1000 + std::llround(1e3 * (sheet_.start_us + from_time * sheet_.block_us));
      add_firing(packet, f, firing_ns, recording);
      absolute_ += sheet_.step;
      ++fired_;
    }
    recording.packets.push_back({packet.take(), static_cast<model::Utime>(last_us) + 100, 2368});
  }

  void put_header(ByteWriter& packet) const {
    if (sheet_.header_bytes == 0) return;
    packet.put<std::uint8_t>(0, 0xEE);
    packet.put<std::uint8_t>(1, 0xFF);
    const std::size_t numbers = sheet_.header_bytes == 8 ? 2 : 6;
    packet.put(numbers, static_cast<std::uint8_t>(sheet_.beams));
    packet.put(numbers + 1, static_cast<std::uint8_t>(sheet_.blocks));
    packet.put(numbers + 3, unit_mm_);
  }

  void put_time(ByteWriter& packet, std::size_t tail, std::int64_t time_us) {
    using namespace std::chrono;
    const bool is_xt = sheet_.header_bytes == 12 && sheet_.model != HesaiModel::kPandarQt;
    const std::size_t clock = sheet_.header_bytes < 12 ? 10 : is_xt ? 19 : 12;
    const std::size_t date = sheet_.header_bytes < 12 ? 16 : is_xt ? 13 : 18;
    packet.put(tail + clock, static_cast<std::uint32_t>(time_us % 1'000'000));

    const sys_seconds second{seconds(time_us / 1'000'000)};
    const auto day = floor<days>(second);
    const year_month_day calendar(day);
    const hh_mm_ss clock_time(second - day);
    // Years since 1900 or 2000, or seconds since 1970, which alone can tell times before 2000.
    const auto form = int(calendar.year()) < 2000 ? 2 : random_() % 3;
    const auto unix_s = static_cast<std::uint32_t>(time_us / 1'000'000);
    const std::uint8_t since_1970[] = {0,
                                       0,
                                       static_cast<std::uint8_t>(unix_s >> 24U),
                                       static_cast<std::uint8_t>(unix_s >> 16U),
                                       static_cast<std::uint8_t>(unix_s >> 8U),
                                       static_cast<std::uint8_t>(unix_s)};
    const int year = int(calendar.year()) - (form == 0 ? 1900 : 2000);
    const std::uint8_t as_date[] = {static_cast<std::uint8_t>(year),
                                    static_cast<std::uint8_t>(unsigned(calendar.month())),
                                    static_cast<std::uint8_t>(unsigned(calendar.day())),
                                    static_cast<std::uint8_t>(clock_time.hours().count()),
                                    static_cast<std::uint8_t>(clock_time.minutes().count()),
                                    static_cast<std::uint8_t>(clock_time.seconds().count())};
    for (std::size_t i = 0; i < 6; ++i)
      packet.put(tail + date + i, form == 2 ? since_1970[i] : as_date[i]);
  }

  void add_firing(ByteWriter& packet, std::size_t firing, std::int64_t firing_ns,
                  MadeUpRecording& recording) {
    const int azimuth = absolute_ % 36'000;
    const int sweep = absolute_ / 36'000 - 1;
    std::vector<std::uint16_t> before(sheet_.beams * returns_, 0);
    for (std::size_t r = 0; r < returns_; ++r) {
      std::size_t at = sheet_.header_bytes + (firing * returns_ + r) * block_bytes();
      if (sheet_.header_bytes == 0) {
        packet.put<std::uint16_t>(at, 0xEEFF);
        at += 2;
      }
      packet.put(at, static_cast<std::uint16_t>(azimuth));
      for (std::size_t beam = 0; beam < sheet_.beams; ++beam) {
        const bool is_same = r > 0 && random_() % 3 == 0;
        std::uint16_t* const earlier = &before[beam * returns_];
        const auto distance =
            is_same ? earlier[r - 1]
                    : static_cast<std::uint16_t>(random_() % 10 == 0 ? 0 : 200 + random_() % 9800);
        const auto reflectivity = static_cast<std::uint8_t>(random_());
        packet.put(at + 2 + beam * sheet_.channel_bytes, distance);
        packet.put(at + 4 + beam * sheet_.channel_bytes, reflectivity);
        const bool is_new = std::find(earlier, earlier + r, distance) == earlier + r;
        earlier[r] = distance;
        const bool is_in_sweep = sweep >= 0 && sweep < static_cast<int>(recording.sweeps.size());
        if (distance > 0 && is_new && is_in_sweep)
          recording.sweeps[static_cast<std::size_t>(sweep)].push_back(
              true_point(beam, distance, firing_ns, azimuth, reflectivity));
      }
    }
  }

  TruePoint true_point(std::size_t beam, std::uint16_t distance, std::int64_t firing_ns,
                       int azimuth, std::uint8_t reflectivity) const {
    const double after_us = hesai_format(sheet_.model).firing_us[beam];
    // Between two blocks the laser rotates on.
    const double angle = beams_[beam].azimuth_rad +
                         kDegree * 0.01 * (azimuth + sheet_.step * after_us / sheet_.block_us);
    const double elevation = beams_[beam].elevation_rad;
    const double range = 1e-3 * unit_mm_ * distance;
    std::uint16_t ring = 0;
    for (const auto& other : beams_) ring += other.elevation_rad < elevation ? 1 : 0;
    return {{range * std::cos(elevation) * std::cos(angle),
             -range * std::cos(elevation) * std::sin(angle), range * std::sin(elevation)},
            firing_ns + std::llround(1e3 * after_us),
            ring,
            reflectivity};
  }

  Sheet sheet_;
  std::size_t returns_;
  std::vector<packets::HesaiBeam> beams_;
  std::mt19937_64& random_;
  std::uint8_t unit_mm_ = 4;
  bool has_sequence_ = true;
  int absolute_ = 0;  ///< Azimuth since the start [0.01 degrees].
  std::int64_t fired_ = 0;
  double start_us_ = 0.0;
};

}  // namespace

std::vector<MadeUpSensor> made_up_hesais() {
  std::vector<MadeUpSensor> sensors;
  for (const Sheet& sheet : kSheets) {
    const std::size_t most = sheet.model == HesaiModel::kXt32m2x ? 3 : 2;
    for (std::size_t returns = 1; returns <= most; ++returns) {
      MadeUpSensor sensor;
      sensor.name = std::string(to_string(sheet.model)) + " returns " + std::to_string(returns);
      sensor.description.model = to_string(sheet.model);
      std::vector<packets::HesaiBeam> beams = hesai_beams(sheet.model);
      if (returns == 2) {
        // With angles of its own.
        std::string csv = "Laser id,Elevation,Azimuth\n";
        for (std::size_t i = 0; i < beams.size(); ++i) {
          beams[i].elevation_rad += 1e-3 * static_cast<double>(i % 7);
          beams[i].azimuth_rad -= 2e-3 * static_cast<double>(i % 5);
          csv += std::to_string(i + 1) + "," + std::to_string(beams[i].elevation_rad / kDegree) +
                 "," + std::to_string(beams[i].azimuth_rad / kDegree) + "\n";
        }
        sensor.description.description = csv;
        sensor.description.source = "angles.csv";
      }
      sensor.tolerance_m = 1e-4;
      sensor.record = [sheet, returns, beams](int sweeps, model::Utime start,
                                              std::mt19937_64& random) {
        return HesaiMaker(sheet, returns, beams, random).record(sweeps, start);
      };
      sensors.push_back(sensor);
    }
  }
  return sensors;
}

}  // namespace understory::test
