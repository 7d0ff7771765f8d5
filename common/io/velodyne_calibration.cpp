// Beam directions of each model.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "common/io/data_error.hpp"
#include "common/io/velodyne.hpp"

namespace understory::io {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

struct Angles {
  double elevation_deg;
  double azimuth_deg;
};

/// VLP-32C manual, table 9-2 (the sensor's own azimuth offsets, clockwise positive).
constexpr std::array<Angles, 32> kVlp32c = {
    {{-25.0, 1.4},  {-1.0, -4.2},   {-1.667, 1.4}, {-15.639, -1.4}, {-11.31, 1.4}, {0.0, -1.4},
     {-0.667, 4.2}, {-8.843, -1.4}, {-7.254, 1.4}, {0.333, -4.2},   {-0.333, 1.4}, {-6.148, -1.4},
     {-5.333, 4.2}, {1.333, -1.4},  {0.667, 4.2},  {-4.0, -1.4},    {-4.667, 1.4}, {1.667, -4.2},
     {1.0, 1.4},    {-3.667, -4.2}, {-3.333, 4.2}, {3.333, -1.4},   {2.333, 1.4},  {-2.667, -1.4},
     {-3.0, 1.4},   {7.0, -1.4},    {4.667, 1.4},  {-2.333, -4.2},  {-2.0, 4.2},   {15.0, -1.4},
     {10.333, 1.4}, {-1.333, -1.4}}};

/// VLP-16 manual: the beams do not meet in one point.
constexpr std::array<double, 16> kVlp16Offsets_mm = {11.2, -0.7, 9.7, -2.2, 8.1, -3.7, 6.6, -5.1,
                                                     5.1,  -6.6, 3.7, -8.1, 2.2, -9.7, 0.7, -11.2};

std::vector<std::uint16_t> rings_of(const std::vector<VelodyneBeam>& beams) {
  std::vector<std::size_t> order(beams.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return beams[i].elevation_rad; });
  std::vector<std::uint16_t> rings(beams.size());
  for (std::size_t r = 0; r < order.size(); ++r) rings[order[r]] = static_cast<std::uint16_t>(r);
  return rings;
}

/// The number after the next `key` from `at` on; moves `at` after it. None at the end.
std::optional<double> number_after(std::string_view text, std::string_view key, std::size_t& at,
                                   std::size_t end) {
  const std::size_t found = text.find(key, at);
  if (found == std::string_view::npos || found >= end) return std::nullopt;
  std::size_t begin = found + key.size();
  while (begin < end && (text[begin] == ' ' || text[begin] == ':' || text[begin] == '>')) ++begin;
  double value = 0.0;
  const auto result = std::from_chars(text.data() + begin, text.data() + end, value);
  if (result.ec != std::errc{} || !std::isfinite(value)) return std::nullopt;
  at = static_cast<std::size_t>(result.ptr - text.data());
  return value;
}

/// The names in the two forms of the file, and the factors that give SI units.
struct Names {
  std::string_view id, azimuth, elevation, distance, vertical, horizontal;
  double to_rad, to_m;
};
constexpr Names kXml = {"<id_>",
                        "<rotCorrection_>",
                        "<vertCorrection_>",
                        "<distCorrection_>",
                        "<vertOffsetCorrection_>",
                        "<horizOffsetCorrection_>",
                        kDegree,
                        0.01};
constexpr Names kYaml = {"laser_id",
                         "rot_correction",
                         "vert_correction",
                         "dist_correction",
                         "vert_offset_correction",
                         "horiz_offset_correction",
                         1.0,
                         1.0};

/// The values of one laser are between two record starts.
VelodyneBeam parse_beam(std::string_view record, const Names& names, const std::string& where) {
  const auto read = [&](std::string_view key, double unit, bool required) {
    std::size_t at = 0;
    const auto value = number_after(record, key, at, record.size());
    if (!value && required) throw DataError(fmt::format("{}: no number for {}", where, key));
    return value.value_or(0.0) * unit;
  };

  VelodyneBeam beam;
  beam.elevation_rad = read(names.elevation, names.to_rad, true);
  beam.azimuth_rad = -read(names.azimuth, names.to_rad, true);
  beam.distance_correction_m = read(names.distance, names.to_m, false);
  beam.vertical_offset_m = read(names.vertical, names.to_m, false);
  beam.horizontal_offset_m = read(names.horizontal, names.to_m, false);
  if (std::abs(beam.elevation_rad) > 1.0 || std::abs(beam.distance_correction_m) > 10.0)
    throw DataError(fmt::format("{}: angles or distances that no laser has", where));

  return beam;
}

}  // namespace

std::optional<VelodyneModel> velodyne_model(std::string_view name) {
  for (const VelodyneModel model : {VelodyneModel::kVlp16, VelodyneModel::kVlp32c,
                                    VelodyneModel::kHdl32e, VelodyneModel::kHdl64e}) {
    if (name == to_string(model)) return model;
  }
  return std::nullopt;
}

std::string_view to_string(VelodyneModel model) {
  switch (model) {
    case VelodyneModel::kVlp16:
      return "vlp16";
    case VelodyneModel::kVlp32c:
      return "vlp32c";
    case VelodyneModel::kHdl32e:
      return "hdl32e";
    case VelodyneModel::kHdl64e:
      return "hdl64e";
  }
  return "";
}

VelodyneCalibration velodyne_calibration(VelodyneModel model) {
  VelodyneCalibration calibration;
  calibration.model = model;
  switch (model) {
    case VelodyneModel::kVlp16:
      for (std::size_t i = 0; i < 16; ++i) {
        VelodyneBeam beam;
        const auto half = static_cast<double>(i / 2);
        beam.elevation_rad = (i % 2 == 0 ? -15.0 + 2.0 * half : 1.0 + 2.0 * half) * kDegree;
        beam.vertical_offset_m = kVlp16Offsets_mm[i] * 1e-3;
        calibration.beams.push_back(beam);
      }

      break;
    case VelodyneModel::kVlp32c:
      calibration.distance_step_m = 0.004;

      for (const Angles& angles : kVlp32c) {
        VelodyneBeam beam;
        beam.elevation_rad = angles.elevation_deg * kDegree;
        beam.azimuth_rad = angles.azimuth_deg * kDegree;
        calibration.beams.push_back(beam);
      }

      break;
    case VelodyneModel::kHdl32e:
      for (std::size_t i = 0; i < 32; ++i) {
        VelodyneBeam beam;
        const auto step = static_cast<double>(i % 2 == 0 ? i / 2 : 16 + i / 2);
        beam.elevation_rad = (-92.0 / 3.0 + 4.0 / 3.0 * step) * kDegree;
        calibration.beams.push_back(beam);
      }

      break;
    case VelodyneModel::kHdl64e:
      throw DataError("hdl64e: each one has a calibration file of its own, which must be given");
  }

  calibration.rings = rings_of(calibration.beams);
  return calibration;
}

VelodyneCalibration parse_hdl64_calibration(std::string_view text, std::string_view source) {
  const Names& names = text.find(kXml.id) != std::string_view::npos ? kXml : kYaml;
  VelodyneCalibration calibration;
  calibration.model = VelodyneModel::kHdl64e;
  calibration.beams.resize(64);
  std::vector<bool> seen(64, false);

  // A record starts at its id in the XML; in the YAML at a "- {" or "-" before its first key.
  const std::string_view start = names.id == kXml.id ? kXml.id : std::string_view("- ");
  std::size_t at = text.find(start);
  while (at != std::string_view::npos) {
    const std::size_t next = text.find(start, at + start.size());
    const std::string_view record =
        text.substr(at, next == std::string_view::npos ? next : next - at);
    std::size_t in_record = 0;
    const auto id = number_after(record, names.id, in_record, record.size());

    if (id && *id >= 0.0 && *id < 64.0 && *id == std::floor(*id)) {
      const auto index = static_cast<std::size_t>(*id);
      calibration.beams[index] =
          parse_beam(record, names, fmt::format("{}: laser {}", source, index));
      seen[index] = true;
    }

    at = next;
  }

  const auto missing = std::ranges::count(seen, false);
  if (missing > 0)
    throw DataError(fmt::format("{}: {} of 64 lasers are not described", source, missing));

  calibration.rings = rings_of(calibration.beams);
  return calibration;
}

}  // namespace understory::io
