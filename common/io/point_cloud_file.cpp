#include "common/io/point_cloud_file.hpp"

#include <fmt/format.h>
#include <lzf.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <sstream>

#include "common/io/data_error.hpp"
#include "common/io/number_reader.hpp"
#include "common/io/recording_folder.hpp"

namespace understory::io {
namespace {

constexpr std::size_t kMostPoints = 20'000'000;

struct Field {
  std::string name;
  char type = 'F';
  std::size_t bytes = 4;
  std::size_t count = 1;
  std::size_t offset = 0;  ///< In a point.
};

struct CloudHeader {
  std::vector<Field> fields;
  std::size_t points = 0;
  std::size_t point_bytes = 0;
  std::string data;     ///< ascii, binary, binary_compressed
  std::size_t end = 0;  ///< Where the points start.
};

[[noreturn]] void refuse(std::string_view source, const std::string& what) {
  throw DataError(fmt::format("{}: {}", source, what));
}

void set_column(std::istringstream& line, std::vector<Field>& fields, const std::string& key) {
  for (Field& field : fields) {
    if (key == "SIZE") line >> field.bytes;
    if (key == "TYPE") line >> field.type;
    if (key == "COUNT") line >> field.count;
  }
}

void check(CloudHeader& header, std::string_view source) {
  for (Field& field : header.fields) {
    const bool fits =
        (field.type == 'F' && (field.bytes == 4 || field.bytes == 8)) ||
        ((field.type == 'U' || field.type == 'I') &&
         (field.bytes == 1 || field.bytes == 2 || field.bytes == 4 || field.bytes == 8));
    if (!fits || field.count == 0 || field.count > 4096)
      refuse(source, fmt::format("field {}: no type that a PCD file has", field.name));
    field.offset = header.point_bytes;
    header.point_bytes += field.bytes * field.count;
  }

  if (header.points > kMostPoints)
    refuse(source,
           fmt::format("{} points, more than the {} that are read", header.points, kMostPoints));

  if (header.fields.empty() || header.fields.size() > 256)
    refuse(source, "no line FIELDS that could be");
}

CloudHeader parse_header(std::string_view bytes, std::string_view source) {
  CloudHeader header;
  std::size_t at = 0;
  while (at < bytes.size()) {
    const std::size_t end = std::min(bytes.find('\n', at), bytes.size());
    std::istringstream line{std::string(bytes.substr(at, std::min<std::size_t>(end - at, 10000)))};
    at = end + 1;
    std::string key;
    line >> key;

    if (key == "FIELDS") {
      std::string name;
      while (line >> name) header.fields.push_back({name});
    } else if (key == "POINTS") {
      line >> header.points;
      if (!line) refuse(source, "POINTS is no number");
    } else if (key == "DATA") {
      line >> header.data;
      header.end = std::min(at, bytes.size());
      check(header, source);
      return header;
    } else {
      set_column(line, header.fields, key);
    }
  }

  refuse(source, "no line DATA");
}

template <class T>
double number_at(const char* at) {
  T value{};
  std::memcpy(&value, at, sizeof value);
  return static_cast<double>(value);
}

double value_at(const Field& field, const char* at) {
  switch (field.type) {
    case 'F':
      return field.bytes == 4 ? number_at<float>(at) : number_at<double>(at);
    case 'U':
      return field.bytes == 1   ? number_at<std::uint8_t>(at)
             : field.bytes == 2 ? number_at<std::uint16_t>(at)
             : field.bytes == 4 ? number_at<std::uint32_t>(at)
                                : number_at<std::uint64_t>(at);
    default:
      return field.bytes == 1   ? number_at<std::int8_t>(at)
             : field.bytes == 2 ? number_at<std::int16_t>(at)
             : field.bytes == 4 ? number_at<std::int32_t>(at)
                                : number_at<std::int64_t>(at);
  }
}

/// All values of one field, point by point.
using Column = std::vector<double>;

std::vector<Column> binary_columns(const CloudHeader& header, std::string_view data,
                                   bool by_field) {
  std::vector<Column> columns(header.fields.size(), Column(header.points));
  std::size_t start = 0;
  for (std::size_t f = 0; f < header.fields.size(); ++f) {
    const Field& field = header.fields[f];
    const std::size_t stride = by_field ? field.bytes * field.count : header.point_bytes;
    const std::size_t first = by_field ? start : field.offset;
    for (std::size_t i = 0; i < header.points; ++i)
      columns[f][i] = value_at(field, data.data() + first + i * stride);
    start += field.bytes * field.count * header.points;
  }
  return columns;
}

std::vector<Column> ascii_columns(const CloudHeader& header, std::string_view text,
                                  std::string_view source) {
  std::vector<Column> columns(header.fields.size());
  std::size_t at = 0;
  const auto next = [&]() -> double {
    while (at < text.size() && std::isspace(static_cast<unsigned char>(text[at])) != 0) ++at;
    const std::size_t begin = at;
    while (at < text.size() && std::isspace(static_cast<unsigned char>(text[at])) == 0) ++at;
    double value = 0.0;
    const auto result = std::from_chars(text.data() + begin, text.data() + at, value);
    if (begin == at || result.ec != std::errc{} || result.ptr != text.data() + at)
      refuse(source, fmt::format("'{}' at byte {} is no number",
                                 text.substr(begin, std::min<std::size_t>(at - begin, 40)), begin));
    return value;
  };

  for (std::size_t i = 0; i < header.points; ++i) {
    for (std::size_t f = 0; f < header.fields.size(); ++f) {
      for (std::size_t c = 0; c < header.fields[f].count; ++c) {
        const double value = next();
        if (c == 0) columns[f].push_back(value);
      }
    }
  }

  return columns;
}

std::vector<Column> columns_of(const CloudHeader& header, std::string_view bytes,
                               std::string_view source) {
  const std::string_view data = bytes.substr(header.end);
  const std::size_t size = header.points * header.point_bytes;
  if (header.data == "ascii") return ascii_columns(header, data, source);

  if (header.data == "binary") {
    if (data.size() < size) refuse(source, fmt::format("{} of {} bytes", data.size(), size));
    return binary_columns(header, data, false);
  }

  if (header.data != "binary_compressed")
    refuse(source, fmt::format("DATA {} is not known", header.data));
  if (data.size() < 8) refuse(source, "cut off");

  const auto packed = static_cast<std::size_t>(number_at<std::uint32_t>(data.data()));
  const auto unpacked = static_cast<std::size_t>(number_at<std::uint32_t>(data.data() + 4));
  if (unpacked != size || packed > data.size() - 8)
    refuse(source, fmt::format("{} bytes for {} points of {}", unpacked, header.points,
                               header.point_bytes));

  return binary_columns(header, decompress_lzf(data.substr(8, packed), unpacked, source), true);
}

}  // namespace

std::string decompress_lzf(std::string_view compressed, std::size_t size, std::string_view source) {
  // LZF makes at most 264 bytes of three: a larger size is wrong, found before allocating.
  if (size > 100 * compressed.size() + 100) refuse(source, "more bytes than LZF can have packed");
  std::string out(size, '\0');
  if (compressed.empty() && size == 0) return out;

  // liblzf counts in 32 bits; 0 is its failure.
  constexpr std::size_t kMost = std::numeric_limits<unsigned int>::max();
  if (compressed.empty() || size > kMost || compressed.size() > kMost)
    refuse(source, "compressed points are cut off");
  const unsigned int unpacked =
      lzf_decompress(compressed.data(), static_cast<unsigned int>(compressed.size()), out.data(),
                     static_cast<unsigned int>(size));
  if (unpacked == 0) refuse(source, "compressed points are damaged");
  if (unpacked != size) refuse(source, "compressed points are cut off");
  return out;
}

model::PointSweep parse_pcd(std::string_view bytes, std::string_view source) {
  const CloudHeader header = parse_header(bytes, source);
  const std::vector<Column> columns = columns_of(header, bytes, source);
  const auto column =
      [&](std::initializer_list<std::string_view> names) -> std::optional<std::size_t> {
    for (std::size_t f = 0; f < header.fields.size(); ++f) {
      if (std::ranges::find(names, header.fields[f].name) != names.end()) return f;
    }
    return std::nullopt;
  };
  const auto x = column({"x"});
  const auto y = column({"y"});
  const auto z = column({"z"});
  if (!x || !y || !z) refuse(source, "no fields x, y and z");
  const auto ring = column({"ring"});
  const auto intensity = column({"intensity", "reflectivity"});
  const auto time = column({"t", "time", "timestamp", "offset_time"});
  const double unit = time && header.fields[*time].type != 'F' ? 1e-9 : 1.0;
  const double start = time && header.points > 0 ? *std::ranges::min_element(columns[*time]) : 0.0;

  model::PointSweep sweep;
  sweep.has_times = time.has_value();
  for (std::size_t i = 0; i < header.points; ++i) {
    model::SweepPoint point;
    point.x_m = static_cast<float>(columns[*x][i]);
    point.y_m = static_cast<float>(columns[*y][i]);
    point.z_m = static_cast<float>(columns[*z][i]);
    if (time) point.time_s = static_cast<float>((columns[*time][i] - start) * unit);
    if (ring) point.ring = static_cast<std::uint16_t>(std::clamp(columns[*ring][i], 0.0, 255.0));
    if (intensity)
      point.intensity = static_cast<std::uint8_t>(std::clamp(columns[*intensity][i], 0.0, 255.0));
    if (!point.position().allFinite() || !(point.time_s >= 0.0F && point.time_s < 1.0F)) continue;
    sweep.rings = std::max<std::uint16_t>(sweep.rings, static_cast<std::uint16_t>(point.ring + 1));
    sweep.max_range_m = std::max(sweep.max_range_m, static_cast<double>(point.position().norm()));
    sweep.points.push_back(point);
  }
  std::ranges::stable_sort(sweep.points, {}, &model::SweepPoint::time_s);
  return sweep;
}

std::vector<PcdFile> find_pcd_sequence(const std::filesystem::path& folder) {
  std::vector<PcdFile> files;
  std::error_code failed;
  for (const auto& entry : std::filesystem::directory_iterator(folder, failed)) {
    if (entry.path().extension() == ".pcd") files.push_back({0, entry.path()});
  }

  if (failed || files.empty())
    throw DataError(fmt::format("{}: no folder with .pcd files", folder.string()));
  std::ranges::sort(files, {}, &PcdFile::path);
  std::vector<double> seconds;
  const std::filesystem::path stamps = folder / "timestamps.txt";

  if (std::filesystem::exists(stamps, failed)) {
    const std::string text = RecordingFolder(folder).read("timestamps.txt");
    NumberReader reader(text, stamps.string());
    while (const auto value = reader.next()) seconds.push_back(*value);
  } else {
    for (const PcdFile& file : files) {
      const std::string stem = file.path.stem().string();
      NumberReader reader(stem, file.path.string());
      const double value = reader.require("a time as the file's name");
      seconds.push_back(value > 1e15 ? value * 1e-9 : value);
    }
  }

  if (seconds.size() != files.size())
    throw DataError(fmt::format("{}: {} files for {} time stamps", folder.string(), files.size(),
                                seconds.size()));

  for (std::size_t i = 0; i < files.size(); ++i) {
    if (!(seconds[i] >= 0.0 && seconds[i] < 9e9))
      throw DataError(fmt::format("{}: {} s is no time", files[i].path.string(), seconds[i]));
    files[i].utime = static_cast<model::Utime>(std::llround(seconds[i] * 1e6));
  }

  std::ranges::stable_sort(files, {}, &PcdFile::utime);
  return files;
}

}  // namespace understory::io
