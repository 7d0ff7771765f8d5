#include "common/packets/ouster_metadata.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "common/io/data_error.hpp"

namespace understory::packets {
namespace {

using Json = nlohmann::json;

constexpr double kRadPerDegree = std::numbers::pi / 180.0;
constexpr double kMetresPerMm = 1e-3;
constexpr std::size_t kMostColumns = 4096;

/// ouster-sdk, `parsing.cpp`: `profiles`.
constexpr std::array<OusterProfile, 10> kProfiles{{
    {"LEGACY", OusterPixel::kLegacy, 12},
    {"RNG19_RFL8_SIG16_NIR16", OusterPixel::kSingle, 12},
    {"RNG19_RFL8_SIG16_NIR16_DUAL", OusterPixel::kDual, 16},
    {"RNG15_RFL8_NIR8", OusterPixel::kLowDataRate, 4},
    {"RNG15_RFL8_NIR8_DUAL", OusterPixel::kLowDataRateDual, 8},
    {"FUSA_RNG15_RFL8_NIR8_DUAL", OusterPixel::kLowDataRateDual, 8, true},
    {"FIVE_WORD_PIXEL", OusterPixel::kDual, 20},
    {"RNG15_RFL8_WIN8", OusterPixel::kLowDataRate, 4},
    {"RNG15_RFL8_NIR8_ZONE16", OusterPixel::kLowDataRate, 8},
    {"RNG19_RFL8_SIG16_NIR16_ZONE16", OusterPixel::kSingle, 12},
}};

/// Where a field is: in a section of the nested layout, or at the top of the flat one.
class Fields {
 public:
  Fields(std::string_view text, const std::string& source)
      : root_(Json::parse(text, nullptr, false)), source_(source) {
    if (root_.is_discarded() || !root_.is_object())
      throw io::DataError(source_ + ": no JSON object: the metadata of an Ouster laser are wanted");
  }

  const Json* find(const char* section, const char* name) const {
    // The flat layout has one section, with another name.
    const bool is_format = section == std::string_view("lidar_data_format");
    for (const char* in : {section, is_format ? "data_format" : section}) {
      const auto found = root_.find(in);
      if (found != root_.end() && found->is_object() && found->contains(name))
        return &found->at(name);
    }
    return root_.contains(name) ? &root_.at(name) : nullptr;
  }

  std::string text(const char* section, const char* name) const {
    const Json* field = find(section, name);
    if (field == nullptr || field->is_null()) return {};
    if (field->is_number_integer()) return std::to_string(field->get<std::int64_t>());
    if (!field->is_string()) fail(name, "is no text");
    return field->get<std::string>();
  }

  std::optional<double> number(const char* section, const char* name) const {
    const Json* field = find(section, name);
    if (field == nullptr || field->is_null()) return std::nullopt;
    if (!field->is_number() || !std::isfinite(field->get<double>())) fail(name, "is no number");
    return field->get<double>();
  }

  std::optional<std::vector<double>> numbers(const char* section, const char* name) const {
    const Json* field = find(section, name);
    if (field == nullptr || field->is_null()) return std::nullopt;
    if (!field->is_array()) fail(name, "is no list of numbers");
    std::vector<double> values;
    for (const Json& value : *field) {
      if (!value.is_number() || !std::isfinite(value.get<double>()))
        fail(name, "is no list of numbers");
      values.push_back(value.get<double>());
    }
    return values;
  }

  /// An integer within [least, most].
  std::size_t whole(const char* name, double value, std::size_t least, std::size_t most) const {
    if (value != std::floor(value) || value < static_cast<double>(least) ||
        value > static_cast<double>(most))
      fail(name, fmt::format("is {}, not a whole number from {} to {}", value, least, most));
    return static_cast<std::size_t>(value);
  }

  [[noreturn]] void fail(std::string_view name, std::string_view what) const {
    throw io::DataError(fmt::format("{}: {} {}", source_, name, what));
  }

 private:
  Json root_;
  std::string source_;
};

/// 4 x 4, by rows, translations in millimetres.
std::optional<Eigen::Isometry3d> transform(const Fields& fields, const char* section,
                                           const char* name) {
  const auto numbers = fields.numbers(section, name);
  if (!numbers) return std::nullopt;
  if (numbers->size() != 16) fields.fail(name, "has no 16 numbers");
  Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
  const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> matrix(numbers->data());
  result.linear() = matrix.topLeftCorner<3, 3>();
  result.translation() = kMetresPerMm * matrix.topRightCorner<3, 1>();

  constexpr double kOrthogonal = 1e-3;
  const Eigen::Matrix3d m = result.linear();
  if (!(m * m.transpose()).isIdentity(kOrthogonal) || m.determinant() < 0.0 ||
      !(result.translation().norm() < 10.0))
    fields.fail(name, "is no rotation and translation [mm]");
  return result;
}

Eigen::Isometry3d shifted_mm(double x, double y, double z) {
  return Eigen::Isometry3d(Eigen::Translation3d(kMetresPerMm * Eigen::Vector3d(x, y, z)));
}

/// Defaults of ouster-sdk, `metadata.cpp`: default_lidar_to_sensor, default_imu_to_sensor.
Eigen::Isometry3d usual_sensor_T_lidar() {
  Eigen::Isometry3d result = shifted_mm(0.0, 0.0, 36.18);
  result.linear() = Eigen::Vector3d(-1.0, -1.0, 1.0).asDiagonal();
  return result;
}
Eigen::Isometry3d usual_sensor_T_imu() { return shifted_mm(6.253, -11.775, 7.645); }

/// Defaults of ouster-sdk, `types.cpp`: default_lidar_origin_to_beam_origin() [mm].
double usual_beam_origin_mm(std::string_view product_line) {
  if (product_line.starts_with("OS-0")) return 27.67;
  if (product_line.starts_with("OS-1")) return 15.806;
  if (product_line.starts_with("OS-2")) return 13.762;
  return 12.163;
}

std::vector<double> beam_angles(const Fields& fields, const char* name) {
  auto angles = fields.numbers("beam_intrinsics", name);
  if (!angles || angles->empty()) fields.fail(name, "is missing");
  constexpr std::array<std::size_t, 4> kBeams{16, 32, 64, 128};
  if (std::ranges::find(kBeams, angles->size()) == kBeams.end())
    fields.fail(name, fmt::format("has {} beams, not 16, 32, 64 or 128", angles->size()));
  for (double& angle : *angles) {
    if (std::abs(angle) > 90.0) fields.fail(name, "has an angle beyond 90 degrees");
    angle *= kRadPerDegree;
  }
  return *std::move(angles);
}

/// Columns from "1024x10".
std::optional<double> columns_of_mode(const std::string& mode) {
  std::size_t columns = 0;
  const auto result = std::from_chars(mode.data(), mode.data() + mode.size(), columns);
  if (result.ec != std::errc{} || result.ptr == mode.data() + mode.size() || *result.ptr != 'x')
    return std::nullopt;
  return static_cast<double>(columns);
}

void read_format(const Fields& fields, OusterMetadata& metadata) {
  std::string profile = fields.text("lidar_data_format", "udp_profile_lidar");
  if (profile.empty()) profile = fields.text("config_params", "udp_profile_lidar");
  if (profile.empty()) profile = "LEGACY";
  const auto known = ouster_profile(profile);
  if (!known) fields.fail("udp_profile_lidar", "\"" + profile + "\" is not known");
  metadata.profile = *known;
  // Since firmware 3.2 the header is chosen separately from the pixels.
  if (fields.text("lidar_data_format", "header_type") == "FUSA" &&
      known->pixel != OusterPixel::kLegacy)
    metadata.profile.has_safety_header = true;

  auto columns = fields.number("lidar_data_format", "columns_per_frame");
  if (!columns) columns = columns_of_mode(fields.text("config_params", "lidar_mode"));
  if (!columns) fields.fail("columns_per_frame", "is missing, and so is lidar_mode");
  metadata.columns_per_frame = fields.whole("columns_per_frame", *columns, 16, kMostColumns);
  metadata.last_column = metadata.columns_per_frame - 1;
  if (const auto per_packet = fields.number("lidar_data_format", "columns_per_packet"))
    metadata.columns_per_packet =
        fields.whole("columns_per_packet", *per_packet, 1, metadata.columns_per_frame);

  const auto window = fields.numbers("lidar_data_format", "column_window");
  if (!window) return;
  if (window->size() != 2) fields.fail("column_window", "has no 2 numbers");
  metadata.first_column = fields.whole("column_window", window->front(), 0, metadata.last_column);
  metadata.last_column = fields.whole("column_window", window->back(), 0, metadata.last_column);
}

void read_geometry(const Fields& fields, OusterMetadata& metadata) {
  metadata.altitude_rad = beam_angles(fields, "beam_altitude_angles");
  metadata.azimuth_rad = beam_angles(fields, "beam_azimuth_angles");
  if (metadata.altitude_rad.size() != metadata.azimuth_rad.size())
    fields.fail("beam_azimuth_angles", "has another length than beam_altitude_angles");
  if (const auto pixels = fields.number("lidar_data_format", "pixels_per_column")) {
    if (*pixels != static_cast<double>(metadata.beams()))
      fields.fail("pixels_per_column",
                  fmt::format("is {}, of {} beam angles", *pixels, metadata.beams()));
  }

  const auto origin_mm = fields.number("beam_intrinsics", "lidar_origin_to_beam_origin_mm");
  if (origin_mm && std::abs(*origin_mm) > 1000.0)
    fields.fail("lidar_origin_to_beam_origin_mm", "is more than a metre");
  metadata.lidar_T_beam =
      transform(fields, "beam_intrinsics", "beam_to_lidar_transform")
          .value_or(shifted_mm(origin_mm.value_or(usual_beam_origin_mm(metadata.product_line)), 0.0,
                               0.0));
  metadata.sensor_T_lidar = transform(fields, "lidar_intrinsics", "lidar_to_sensor_transform")
                                .value_or(usual_sensor_T_lidar());
  metadata.sensor_T_imu =
      transform(fields, "imu_intrinsics", "imu_to_sensor_transform").value_or(usual_sensor_T_imu());
}

}  // namespace

std::span<const OusterProfile> ouster_profiles() { return kProfiles; }

std::optional<OusterProfile> ouster_profile(std::string_view name) {
  const auto found = std::ranges::find(kProfiles, name, &OusterProfile::name);
  return found == kProfiles.end() ? std::nullopt : std::optional(*found);
}

OusterMetadata parse_ouster_metadata(std::string_view text, const std::string& source) {
  const Fields fields(text, source);
  OusterMetadata metadata;
  metadata.product_line = fields.text("sensor_info", "prod_line");
  read_format(fields, metadata);
  read_geometry(fields, metadata);
  return metadata;
}

}  // namespace understory::packets
