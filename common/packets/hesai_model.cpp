#include "common/packets/hesai_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numbers>

#include "common/io/data_error.hpp"
#include "common/packets/hesai_tables.hpp"

namespace understory::packets {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180.0;
constexpr std::array<std::pair<std::string_view, HesaiModel>, 6> kHesaiModels{
    {{"pandar40p", HesaiModel::kPandar40p},
     {"pandar64", HesaiModel::kPandar64},
     {"pandarqt", HesaiModel::kPandarQt},
     {"xt16", HesaiModel::kPandarXt16},
     {"xt32", HesaiModel::kPandarXt32},
     {"xt32m2x", HesaiModel::kXt32m2x}}};

/// Firing times of beams that fire in sequence, every `step_us`; restarts at 0 after `beams` of
/// them.
std::vector<double> even_firing_us(std::size_t count, double first_us, double step_us,
                                   std::size_t beams) {
  std::vector<double> result;
  for (std::size_t i = 0; i < count; ++i)
    result.push_back(first_us + step_us * static_cast<double>(i % beams));
  return result;
}

/// Pandar40P and Pandar64 manuals, "Absolute Time of Point Cloud Data": shots are before the
/// block's time (`laser40Offset_` and `laser64Offset_` of HesaiLidar_General_SDK).
template <std::size_t kSize>
std::vector<double> before_block(const std::array<double, kSize>& offsets_us) {
  std::vector<double> result(offsets_us.begin(), offsets_us.end());
  for (double& offset : result) offset = -offset;
  return result;
}

/// PandarXT-16, XT-32 and XT32M2X: header 12, tail 24 + 4 bytes (HesaiLidar_SDK_2.0,
/// `udp_protocol_v6_1.h`); times of blocks and beams `pandarXT.h` of HesaiLidar_General_SDK.
HesaiFormat xt_format(std::size_t blocks, std::size_t beams, std::vector<double> firing_us,
                      double max_range_m) {
  return {12,         blocks, beams, 0, 2, 4, 24, 19, 13, 5.632, 50.0, true, std::move(firing_us),
          max_range_m};
}

std::vector<std::string_view> split(std::string_view line) {
  std::vector<std::string_view> fields;
  while (true) {
    const std::size_t end = line.find_first_of(",;\t");
    std::string_view field = line.substr(0, end);
    while (!field.empty() && (field.front() == ' ' || field.front() == '\r'))
      field.remove_prefix(1);
    while (!field.empty() && (field.back() == ' ' || field.back() == '\r')) field.remove_suffix(1);
    fields.push_back(field);
    if (end == std::string_view::npos) return fields;
    line.remove_prefix(end + 1);
  }
}

std::optional<double> number_of(std::string_view field) {
  double value = 0.0;
  const auto result = std::from_chars(field.data(), field.data() + field.size(), value);
  if (result.ec != std::errc{} || result.ptr != field.data() + field.size()) return std::nullopt;
  return std::isfinite(value) ? std::optional(value) : std::nullopt;
}

bool is_heading(std::string_view line) {
  return line.find("levation") != std::string_view::npos &&
         line.find("zimuth") != std::string_view::npos;
}

}  // namespace

std::optional<HesaiModel> hesai_model(std::string_view name) {
  for (const auto& [known, model] : kHesaiModels) {
    if (name == known) return model;
  }
  return std::nullopt;
}

std::string_view to_string(HesaiModel model) {
  return std::ranges::find(kHesaiModels, model, [](const auto& m) { return m.second; })->first;
}

HesaiFormat hesai_format(HesaiModel model) {
  constexpr double kXtShot_us = 1.512;
  constexpr double kXtFirst_us = 0.368;
  switch (model) {
    case HesaiModel::kPandar40p:
      // Pandar40P manual, "Point Cloud Data Packet": each block begins with 0xFFEE; no header.
      return {
          0,    10, 40, 2, 4, 3, 22, 10, 16, -28.58, 55.56, true, before_block(kPandar40pFiring_us),
          200.0};
    case HesaiModel::kPandar64:
      // Pandar64 manual, "Point Cloud Data Packet"; `udp_protocol_p64.h`.
      return {
          8,    6, 64, 0, 2, 3, 22, 10, 16, -42.58, 55.56, true, before_block(kPandar64Firing_us),
          200.0};
    case HesaiModel::kPandarQt:
      // `udp_protocol_v3_1.h`; times: `blockQTOffset*` and `laserQTOffset_`.
      return {12,
              4,
              64,
              0,
              2,
              4,
              24,
              12,
              18,
              35.71,
              166.67,
              false,
              {kPandarQtFiring_us.begin(), kPandarQtFiring_us.end()},
              60.0};
    case HesaiModel::kPandarXt16:
      return xt_format(8, 16, even_firing_us(16, kXtFirst_us, 2.0 * kXtShot_us, 16), 120.0);
    case HesaiModel::kPandarXt32:
      return xt_format(8, 32, even_firing_us(32, kXtFirst_us, kXtShot_us, 32), 120.0);
    case HesaiModel::kXt32m2x:
      break;
  }
  return xt_format(6, 32, even_firing_us(32, kXtFirst_us, 2.856, 16), 300.0);
}

std::vector<HesaiBeam> hesai_beams(HesaiModel model) {
  std::vector<HesaiBeam> beams;
  const auto add = [&](double elevation_deg, double azimuth_deg) {
    beams.push_back({elevation_deg * kRadPerDeg, azimuth_deg * kRadPerDeg});
  };
  switch (model) {
    case HesaiModel::kPandar40p:
      for (const auto& [elevation, azimuth] : kPandar40pAngles_deg) add(elevation, azimuth);
      break;
    case HesaiModel::kPandar64:
      for (const auto& [elevation, azimuth] : kPandar64Angles_deg) add(elevation, azimuth);
      break;
    case HesaiModel::kPandarQt:
      for (const auto& [elevation, azimuth] : kPandarQtAngles_deg) add(elevation, azimuth);
      break;
    case HesaiModel::kPandarXt16:
      for (int i = 0; i < 16; ++i) add(15.0 - 2.0 * i, 0.0);
      break;
    case HesaiModel::kPandarXt32:
      for (int i = 0; i < 32; ++i) add(15.0 - i, 0.0);
      break;
    case HesaiModel::kXt32m2x:
      for (int i = 0; i < 32; ++i) add(19.5 - 1.3 * i, 0.0);
      break;
  }
  return beams;
}

std::vector<HesaiBeam> parse_hesai_angles(std::string_view text, HesaiModel model,
                                          const std::string& source) {
  constexpr double kSteepest_deg = 90.0;
  std::vector<std::optional<HesaiBeam>> beams(hesai_format(model).beams);
  bool has_heading = false;
  std::size_t number = 0;

  while (!text.empty()) {
    ++number;
    const std::size_t end = text.find('\n');
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    if (!has_heading) {
      has_heading = is_heading(line);
      continue;
    }
    const auto fields = split(line);
    if (fields.size() < 3) continue;  // blank, or a line of the file's version

    const auto channel = number_of(fields[0]);
    const auto elevation = number_of(fields[1]);
    const auto azimuth = number_of(fields[2]);
    if (!channel || !elevation || !azimuth || std::abs(*elevation) > kSteepest_deg ||
        std::abs(*azimuth) > kSteepest_deg)
      throw io::DataError(
          fmt::format("{}, line {}: no channel, elevation and azimuth [degrees]", source, number));
    if (!(*channel >= 1.0 && *channel <= static_cast<double>(beams.size())))
      throw io::DataError(fmt::format("{}, line {}: channel {} of a {}, which has {}", source,
                                      number, *channel, to_string(model), beams.size()));
    beams[static_cast<std::size_t>(*channel) - 1] =
        HesaiBeam{*elevation * kRadPerDeg, *azimuth * kRadPerDeg};
  }

  const auto missing = std::ranges::count_if(beams, [](const auto& beam) { return !beam; });
  if (!has_heading)
    throw io::DataError(source +
                        ": no heading with Elevation and Azimuth: an angle correction file "
                        "is wanted");
  if (missing > 0)
    throw io::DataError(
        fmt::format("{}: {} of {} channels are missing", source, missing, beams.size()));
  std::vector<HesaiBeam> result;
  result.reserve(beams.size());
  for (const auto& beam : beams) result.push_back(*beam);
  return result;
}

std::optional<HesaiModel> recognise_hesai(std::span<const std::uint8_t> bytes) {
  for (const auto& [name, model] : kHesaiModels) {
    const HesaiFormat format = hesai_format(model);
    const bool has_size =
        bytes.size() == format.packet(false) || bytes.size() == format.packet(true);
    if (!has_size) continue;
    // Start of packet, numbers of beams and blocks (`udp_protocol_header.h`).
    const bool has_header = format.header > 0;
    const std::size_t numbers_at = format.header == 8 ? 2 : 6;
    if (has_header && (bytes[0] != 0xEE || bytes[1] != 0xFF || bytes[numbers_at] != format.beams ||
                       bytes[numbers_at + 1] != format.blocks))
      continue;
    if (!has_header && (bytes[0] != 0xFF || bytes[1] != 0xEE)) continue;
    return model;
  }
  return std::nullopt;
}

}  // namespace understory::packets
