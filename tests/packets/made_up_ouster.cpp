// Ouster's packets after its firmware user manual, with the geometry written out.
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "tests/packets/byte_writer.hpp"
#include "tests/packets/made_up_sensor.hpp"

namespace understory::test {
namespace {

using packets::OusterMetadata;

constexpr double kDeg = std::numbers::pi / 180.0;
constexpr const char* kSerial = "122150000000";

double uniform(double from, double to, std::mt19937_64& random) {
  return std::uniform_real_distribution<double>(from, to)(random);
}

nlohmann::json by_rows(const Eigen::Isometry3d& transform) {
  nlohmann::json numbers = nlohmann::json::array();
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) {
      const double unit = column == 3 && row < 3 ? 1000.0 : 1.0;
      numbers.push_back(unit * transform.matrix()(row, column));
    }
  }
  return numbers;
}

nlohmann::json in_degrees(const std::vector<double>& angles_rad) {
  nlohmann::json numbers = nlohmann::json::array();
  for (const double angle : angles_rad) numbers.push_back(angle / kDeg);
  return numbers;
}

/// Range of a pixel in the unit of its profile; 0 = no return.
struct Pixel {
  std::uint32_t range_mm = 0;
  std::uint8_t reflectivity = 0;
};

/// What a profile's name says: bits of the range, returns.
bool is_coarse(const std::string& profile) { return profile.find("RNG15") != std::string::npos; }
bool has_two_returns(const std::string& profile) {
  return profile.ends_with("DUAL") || profile == "FIVE_WORD_PIXEL";
}

Pixel random_pixel(const std::string& profile, std::mt19937_64& random) {
  if (random() % 10 == 0) return {};
  const auto range = static_cast<std::uint32_t>(uniform(600.0, 60'000.0, random));
  return {is_coarse(profile) ? range / 8 * 8 : range, static_cast<std::uint8_t>(random())};
}

std::size_t bytes_of_pixel(const std::string& profile) {
  if (profile == "FIVE_WORD_PIXEL") return 20;
  if (profile == "RNG15_RFL8_NIR8" || profile == "RNG15_RFL8_WIN8") return 4;
  if (is_coarse(profile)) return 8;
  return profile == "RNG19_RFL8_SIG16_NIR16_DUAL" ? 16 : 12;
}

void put_pixel(ByteWriter& packet, std::size_t at, const std::string& profile, const Pixel& first,
               const Pixel& second) {
  if (is_coarse(profile)) {
    packet.put_bits(at, first.range_mm / 8, 0x7FFF);
    packet.put(at + 2, first.reflectivity);
    if (!has_two_returns(profile)) return;
    packet.put_bits(at + 4, second.range_mm / 8, 0x7FFF);
    packet.put(at + 6, second.reflectivity);
  } else if (has_two_returns(profile)) {
    packet.put_bits(at, first.range_mm, 0x7FFFF);
    packet.put(at + 3, first.reflectivity);
    packet.put_bits(at + 4, second.range_mm, 0x7FFFF);
    packet.put(at + 7, second.reflectivity);
  } else if (profile == "LEGACY") {
    packet.put_bits(at, first.range_mm, 0xFFFFF);
    packet.put<std::uint16_t>(at + 4, first.reflectivity);
  } else {
    packet.put_bits(at, first.range_mm, 0x7FFFF);
    packet.put(at + 4, first.reflectivity);
  }
}

/// One sensor that rotates.
class OusterMaker {
 public:
  OusterMaker(const OusterMetadata& metadata, std::mt19937_64& random)
      : metadata_(metadata), profile_(metadata.profile.name), random_(random) {}

  MadeUpRecording record(int sweeps, model::Utime start) {
    // A frame of which the begin is missing, whole ones, and the first packet of another.
    const std::size_t per_frame = metadata_.columns_per_frame / metadata_.columns_per_packet;
    frame_ = static_cast<std::uint32_t>(random_()) & 0xFFFFU;
    column_ns_ = 100'000'000 / static_cast<std::int64_t>(metadata_.columns_per_frame);
    time_ns_ = start * 1000;
    MadeUpRecording recording;
    std::vector<TruePoint> unused;
    for (std::size_t p = per_frame / 2; p < per_frame; ++p) add_packet(p, unused, recording);
    for (int s = 0; s < sweeps; ++s) {
      ++frame_;
      std::vector<TruePoint>& points = recording.sweeps.emplace_back();
      for (std::size_t p = 0; p < per_frame; ++p) {
        add_packet(p, points, recording);
        if (p % 8 == 0) add_imu(recording);
      }
    }
    ++frame_;
    add_packet(0, unused, recording);
    return recording;
  }

 private:
  bool is_in_window(std::size_t column) const {
    const auto first = metadata_.first_column;
    const auto last = metadata_.last_column;
    if (first <= last) return column >= first && column <= last;
    return column >= first || column <= last;
  }

  void add_packet(std::size_t number, std::vector<TruePoint>& points, MadeUpRecording& recording) {
    const bool is_legacy = profile_ == "LEGACY";
    const std::size_t column_bytes =
        (is_legacy ? 20 : 12) + metadata_.beams() * bytes_of_pixel(profile_);
    const std::size_t columns = metadata_.columns_per_packet;
    ByteWriter packet((is_legacy ? 0 : 64) + columns * column_bytes, random_);
    if (metadata_.profile.has_safety_header) {
      packet.put<std::uint8_t>(0, 1);
      packet.put<std::uint32_t>(4, frame_);
    } else if (!is_legacy) {
      packet.put<std::uint16_t>(0, 1);
      packet.put(2, static_cast<std::uint16_t>(frame_));
    }

    bool has_any = false;
    for (std::size_t c = 0; c < columns; ++c) {
      const std::size_t at = (is_legacy ? 0 : 32) + c * column_bytes;
      // The window's first column begins a frame, wherever it is.
      const std::size_t column =
          (metadata_.first_column / columns * columns + number * columns + c) %
          metadata_.columns_per_frame;
      const bool is_valid = is_in_window(column);
      has_any = has_any || is_valid;
      packet.put(at, time_ns_);
      packet.put(at + 8, static_cast<std::uint16_t>(column));
      if (is_legacy) {
        packet.put(at + 10, static_cast<std::uint16_t>(frame_));
        packet.put<std::uint32_t>(at + column_bytes - 4, is_valid ? 0xFFFFFFFF : 0);
      } else {
        packet.put<std::uint16_t>(at + 10, is_valid ? 1 : 0);
      }
      add_column(packet, at + (is_legacy ? 16 : 12), column, is_valid, points);
      time_ns_ += column_ns_;
    }
    if (has_any) recording.packets.push_back({packet.take(), time_ns_ / 1000, 7502});
  }

  void add_column(ByteWriter& packet, std::size_t at, std::size_t column, bool is_valid,
                  std::vector<TruePoint>& points) {
    for (std::size_t beam = 0; beam < metadata_.beams(); ++beam) {
      const Pixel first = random_pixel(profile_, random_);
      const Pixel second = random_() % 3 == 0 ? first : random_pixel(profile_, random_);
      put_pixel(packet, at + beam * bytes_of_pixel(profile_), profile_, first, second);
      if (!is_valid) continue;
      add_point(beam, column, first, points);
      if (has_two_returns(profile_) && second.range_mm != first.range_mm)
        add_point(beam, column, second, points);
    }
  }

  /// Manual, "Lidar range to XYZ": origin of the beam on a circle, direction from there.
  void add_point(std::size_t beam, std::size_t column, const Pixel& pixel,
                 std::vector<TruePoint>& points) const {
    if (pixel.range_mm == 0) return;
    const double encoder =
        2.0 * std::numbers::pi *
        (1.0 - static_cast<double>(column) / static_cast<double>(metadata_.columns_per_frame));
    const double azimuth = -metadata_.azimuth_rad[beam];
    const double altitude = metadata_.altitude_rad[beam];
    const double nx = metadata_.lidar_T_beam.translation().x();
    const double nz = metadata_.lidar_T_beam.translation().z();
    const double r = 1e-3 * pixel.range_mm - std::hypot(nx, nz);
    const Eigen::Vector3d in_lidar(
        r * std::cos(encoder + azimuth) * std::cos(altitude) + nx * std::cos(encoder),
        r * std::sin(encoder + azimuth) * std::cos(altitude) + nx * std::sin(encoder),
        r * std::sin(altitude) + nz);
    std::uint16_t ring = 0;
    for (const double other : metadata_.altitude_rad) ring += other < altitude ? 1 : 0;
    points.push_back({metadata_.sensor_T_lidar * in_lidar, time_ns_, ring, pixel.reflectivity});
  }

  model::ImuSample random_sample(std::int64_t time_ns, std::size_t sequence, Eigen::Vector3f& first,
                                 Eigen::Vector3f& second, double first_unit, double second_unit) {
    for (int axis = 0; axis < 3; ++axis) {
      first[axis] = static_cast<float>(uniform(-2.0, 2.0, random_));
      second[axis] = static_cast<float>(uniform(-90.0, 90.0, random_));
    }
    model::ImuSample sample;
    sample.utime = time_ns / 1000;
    sample.sequence = sequence;
    const Eigen::Matrix3d rotation = metadata_.sensor_T_imu.linear();
    sample.specific_force_mps2 = rotation * first.cast<double>() * first_unit;
    sample.angular_rate_rad_s = rotation * second.cast<double>() * second_unit;
    return sample;
  }

  static void put_vectors(ByteWriter& packet, std::size_t at, const Eigen::Vector3f& first,
                          const Eigen::Vector3f& second) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      packet.put(at + 4 * axis, first[static_cast<int>(axis)]);
      packet.put(at + 12 + 4 * axis, second[static_cast<int>(axis)]);
    }
  }

  /// Firmware before 3.2: one sample in g and degrees. Later: eight in SI units, some not valid.
  void add_imu(MadeUpRecording& recording) {
    Eigen::Vector3f first;
    Eigen::Vector3f second;
    if (profile_ != "RNG15_RFL8_NIR8_DUAL") {
      ByteWriter packet(48, random_);
      recording.imu.push_back(
          random_sample(time_ns_, recording.imu.size(), first, second, 9.80665, kDeg));
      put_vectors(packet, 24, first, second);
      packet.put(8, time_ns_);
      recording.packets.push_back({packet.take(), time_ns_ / 1000, 7503});
      return;
    }

    constexpr std::size_t kSamples = 8;
    ByteWriter packet(32 + 100 + kSamples * 36 + 32, random_);
    packet.put<std::uint16_t>(0, 2);
    for (std::size_t i = 0; i < kSamples; ++i) {
      const std::size_t at = 132 + 36 * i;
      const bool is_valid = random_() % 5 != 0;
      const std::int64_t sample_ns = time_ns_ + 1000 * static_cast<std::int64_t>(i);
      const auto sample = random_sample(sample_ns, recording.imu.size(), first, second, 1.0, 1.0);
      put_vectors(packet, at + 12, first, second);
      packet.put(at, sample_ns);
      packet.put<std::uint16_t>(at + 10, is_valid ? 1 : 0);
      if (is_valid) recording.imu.push_back(sample);
    }
    recording.packets.push_back({packet.take(), time_ns_ / 1000, 7503});
  }

  OusterMetadata metadata_;
  std::string profile_;
  std::mt19937_64& random_;
  std::uint32_t frame_ = 0;
  std::int64_t column_ns_ = 0;
  std::int64_t time_ns_ = 0;
};

Eigen::Isometry3d random_transform(std::mt19937_64& random) {
  Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
  const Eigen::Vector3d axis(uniform(-1.0, 1.0, random), uniform(-1.0, 1.0, random), 0.5);
  result.linear() =
      Eigen::AngleAxisd(uniform(-3.0, 3.0, random), axis.normalized()).toRotationMatrix();
  for (int i = 0; i < 3; ++i) result.translation()[i] = uniform(-0.1, 0.1, random);
  return result;
}

MadeUpSensor made_up_ouster(const OusterMetadata& metadata, bool is_nested) {
  MadeUpSensor sensor;
  sensor.name = std::string("ouster ") + std::to_string(metadata.beams()) + " beams " +
                std::to_string(metadata.columns_per_frame) + " columns " +
                std::string(metadata.profile.name) + (is_nested ? "" : " flat");
  sensor.description.model = "ouster";
  sensor.description.description = ouster_json(metadata, is_nested);
  sensor.description.source = "os.json";
  sensor.tolerance_m = 1e-4;
  sensor.record = [metadata](int sweeps, model::Utime start, std::mt19937_64& random) {
    return OusterMaker(metadata, random).record(sweeps, start);
  };
  return sensor;
}

}  // namespace

packets::OusterMetadata random_ouster(const std::string& profile, std::size_t beams,
                                      std::size_t columns, std::mt19937_64& random) {
  OusterMetadata metadata;
  metadata.product_line = "OS-1-" + std::to_string(beams);
  metadata.profile = packets::ouster_profile(profile).value();
  metadata.columns_per_frame = columns;
  metadata.last_column = columns - 1;
  for (std::size_t beam = 0; beam < beams; ++beam) {
    const double share = static_cast<double>(beam) / static_cast<double>(beams);
    metadata.altitude_rad.push_back(kDeg * (22.0 - 44.0 * share + uniform(0.0, 0.1, random)));
    metadata.azimuth_rad.push_back(kDeg * uniform(-5.0, 5.0, random));
  }
  metadata.lidar_T_beam.translation() << 0.0158, 0.0, uniform(-0.01, 0.01, random);
  metadata.sensor_T_lidar = random_transform(random);
  metadata.sensor_T_imu = random_transform(random);
  return metadata;
}

std::string ouster_json(const OusterMetadata& metadata, bool is_nested) {
  nlohmann::json format = {{"columns_per_frame", metadata.columns_per_frame},
                           {"columns_per_packet", metadata.columns_per_packet},
                           {"pixels_per_column", metadata.beams()},
                           {"column_window", {metadata.first_column, metadata.last_column}},
                           {"udp_profile_lidar", metadata.profile.name},
                           {"udp_profile_imu", "LEGACY"}};
  if (!metadata.profile.name.starts_with("FUSA") && metadata.profile.has_safety_header)
    format["header_type"] = "FUSA";
  nlohmann::json beams = {
      {"beam_altitude_angles", in_degrees(metadata.altitude_rad)},
      {"beam_azimuth_angles", in_degrees(metadata.azimuth_rad)},
      {"beam_to_lidar_transform", by_rows(metadata.lidar_T_beam)},
      {"lidar_origin_to_beam_origin_mm", 1000.0 * metadata.lidar_T_beam.translation().x()}};
  const std::string mode = std::to_string(metadata.columns_per_frame) + "x10";
  nlohmann::json root;
  if (is_nested) {
    root["sensor_info"] = {{"prod_line", metadata.product_line}, {"prod_sn", kSerial}};
    root["config_params"] = {{"lidar_mode", mode},
                             {"timestamp_mode", "TIME_FROM_PTP_1588"},
                             {"signal_multiplier", 1.0},
                             {"udp_port_lidar", 7502},
                             {"udp_port_imu", 7503}};
    root["lidar_data_format"] = format;
    root["beam_intrinsics"] = beams;
    root["lidar_intrinsics"]["lidar_to_sensor_transform"] = by_rows(metadata.sensor_T_lidar);
    root["imu_intrinsics"]["imu_to_sensor_transform"] = by_rows(metadata.sensor_T_imu);
    root["calibration_status"] = nlohmann::json::object();
  } else {
    root = beams;
    root["prod_line"] = metadata.product_line;
    root["prod_sn"] = kSerial;
    root["lidar_mode"] = mode;
    root["data_format"] = format;
    root["lidar_to_sensor_transform"] = by_rows(metadata.sensor_T_lidar);
    root["imu_to_sensor_transform"] = by_rows(metadata.sensor_T_imu);
  }
  return root.dump();
}

std::vector<MadeUpSensor> made_up_ousters() {
  std::mt19937_64 random(11);
  std::vector<MadeUpSensor> sensors;
  const auto add = [&](const std::string& profile, std::size_t beams, std::size_t columns,
                       std::size_t first, std::size_t last, bool has_safety_header = false) {
    OusterMetadata metadata = random_ouster(profile, beams, columns, random);
    metadata.first_column = first;
    metadata.last_column = last;
    if (has_safety_header) metadata.profile.has_safety_header = true;
    sensors.push_back(made_up_ouster(metadata, sensors.size() % 2 == 0 || has_safety_header));
  };
  add("LEGACY", 16, 512, 0, 511);
  add("RNG19_RFL8_SIG16_NIR16", 32, 512, 0, 511);
  add("RNG19_RFL8_SIG16_NIR16_DUAL", 64, 512, 0, 511);
  add("RNG15_RFL8_NIR8", 128, 512, 0, 511);
  add("FUSA_RNG15_RFL8_NIR8_DUAL", 32, 512, 0, 511);
  add("LEGACY", 64, 1024, 0, 1023);
  add("RNG19_RFL8_SIG16_NIR16", 16, 2048, 0, 2047);
  // Firmware 3.2: more profiles, headers apart from them.
  add("RNG15_RFL8_NIR8_DUAL", 64, 512, 0, 511);
  add("RNG19_RFL8_SIG16_NIR16", 32, 512, 0, 511, true);
  add("RNG15_RFL8_NIR8_ZONE16", 16, 512, 0, 511);
  add("RNG19_RFL8_SIG16_NIR16_ZONE16", 16, 512, 0, 511);
  add("RNG15_RFL8_WIN8", 32, 512, 0, 511);
  add("FIVE_WORD_PIXEL", 16, 512, 0, 511);
  // Azimuth windows: within, and through column 0.
  add("RNG19_RFL8_SIG16_NIR16", 16, 1024, 100, 700);
  add("RNG19_RFL8_SIG16_NIR16_DUAL", 16, 1024, 900, 150);
  return sensors;
}

}  // namespace understory::test
