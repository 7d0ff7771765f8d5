#include <fmt/format.h>
#include <lzf.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <sstream>

#include "common/bag/cloud_fields.hpp"
#include "common/bag/cloud_file.hpp"
#include "common/bag/text_points.hpp"
#include "common/io/data_error.hpp"

namespace understory::bag {
namespace {

constexpr std::uint64_t kMostPcdPoints = 20'000'000;
constexpr std::string_view kPadding = "_";

[[noreturn]] void refuse(std::string_view source, const std::string& what) {
  throw io::DataError(fmt::format("{}: {}", source, what));
}

/// A column of the header: SIZE, TYPE and COUNT of one name.
struct PcdField {
  std::string name;
  char type = 'F';
  std::uint32_t bytes = 4;
  std::uint32_t count = 1;

  std::uint32_t size() const { return bytes * count; }
};

struct PcdHeader {
  std::vector<PcdField> fields;
  std::optional<std::uint64_t> width, height, points;
  Eigen::Isometry3d viewpoint = Eigen::Isometry3d::Identity();
  std::string data;     ///< ascii, binary, binary_compressed
  std::size_t end = 0;  ///< Offset of the first point.
};

/// Number of a type in PointField; 0 = none.
std::uint8_t field_type(const PcdField& field) {
  struct Known {
    char type;
    std::uint32_t bytes;
    FieldType number;
  };
  constexpr std::array<Known, 10> kKnown{{{'I', 1, FieldType::kInt8},
                                          {'U', 1, FieldType::kUint8},
                                          {'I', 2, FieldType::kInt16},
                                          {'U', 2, FieldType::kUint16},
                                          {'I', 4, FieldType::kInt32},
                                          {'U', 4, FieldType::kUint32},
                                          {'F', 4, FieldType::kFloat32},
                                          {'F', 8, FieldType::kFloat64},
                                          {'I', 8, FieldType::kInt64},
                                          {'U', 8, FieldType::kUint64}}};
  for (const Known& known : kKnown) {
    if (known.type == field.type && known.bytes == field.bytes)
      return static_cast<std::uint8_t>(known.number);
  }
  return 0;
}

std::uint64_t count_in(std::istringstream& line, const std::string& key, std::string_view source) {
  std::string word;
  line >> word;
  std::uint64_t value = 0;
  const auto read = std::from_chars(word.data(), word.data() + word.size(), value);
  if (word.empty() || read.ec != std::errc{} || read.ptr != word.data() + word.size())
    refuse(source, fmt::format("{} '{}' is no number", key, word));
  return value;
}

Eigen::Isometry3d viewpoint_in(std::istringstream& line, std::string_view source) {
  std::array<double, 7> v{};
  for (double& value : v) line >> value;
  const Eigen::Quaterniond turn(v[3], v[4], v[5], v[6]);
  if (!line || !(std::abs(turn.norm() - 1.0) < 1e-3))
    refuse(source, "VIEWPOINT is no place and direction (tx ty tz qw qx qy qz)");
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = turn.normalized().toRotationMatrix();
  pose.translation() = Eigen::Vector3d(v[0], v[1], v[2]);
  return pose;
}

void check(PcdHeader& header, std::string_view source) {
  if (header.fields.empty() || header.fields.size() > 256)
    refuse(source, "no line FIELDS that could be");
  for (const PcdField& field : header.fields) {
    if (field.count == 0 || field.count > 4096 ||
        (field.name != kPadding && field_type(field) == 0))
      refuse(source, fmt::format("field {}: no type that a PCD file has", field.name));
  }

  if (!header.points) header.points = header.width.value_or(0) * header.height.value_or(1);
  if (*header.points > kMostPcdPoints)
    refuse(source, fmt::format("{} points, more than the {} that are read", *header.points,
                               kMostPcdPoints));
  const std::uint64_t height = header.height.value_or(1);
  const std::uint64_t width = header.width.value_or(*header.points);
  if (height > kMostPcdPoints || width > kMostPcdPoints || width * height != *header.points)
    refuse(source,
           fmt::format("WIDTH {} times HEIGHT {} is not POINTS {}", width, height, *header.points));
  header.height = height;
  header.width = width;
}

void read_line(std::istringstream& line, const std::string& key, std::string_view source,
               PcdHeader& header) {
  if (key == "FIELDS" || key == "COLUMNS") {
    std::string name;
    while (line >> name) header.fields.push_back({name});
  } else if (key == "POINTS") {
    header.points = count_in(line, key, source);
  } else if (key == "WIDTH") {
    header.width = count_in(line, key, source);
  } else if (key == "HEIGHT") {
    header.height = count_in(line, key, source);
  } else if (key == "VIEWPOINT") {
    header.viewpoint = viewpoint_in(line, source);
  } else {
    for (PcdField& field : header.fields) {
      if (key == "SIZE") line >> field.bytes;
      if (key == "TYPE") line >> field.type;
      if (key == "COUNT") line >> field.count;
    }
  }
}

PcdHeader parse_header(std::string_view bytes, std::string_view source) {
  PcdHeader header;
  std::size_t at = 0;
  while (at < bytes.size()) {
    const std::size_t end = std::min(bytes.find('\n', at), bytes.size());
    std::istringstream line{std::string(bytes.substr(at, std::min<std::size_t>(end - at, 10000)))};
    at = end + 1;
    std::string key;
    line >> key;
    if (key != "DATA") {
      read_line(line, key, source, header);
      continue;
    }
    line >> header.data;
    header.end = std::min(at, bytes.size());
    check(header, source);
    return header;
  }
  refuse(source, "no line DATA");
}

std::string unpack_lzf(std::string_view packed, std::uint64_t size, std::string_view source) {
  // LZF expands three bytes to at most 264: a larger size is refused before allocating.
  constexpr std::uint64_t kMost = std::numeric_limits<unsigned int>::max();
  if (size > 100 * packed.size() + 100 || size > kMost || packed.size() > kMost)
    refuse(source, "more bytes than LZF can have packed");
  std::string out(size, '\0');
  if (size == 0) return out;

  const unsigned int unpacked =
      packed.empty() ? 0
                     : lzf_decompress(packed.data(), static_cast<unsigned int>(packed.size()),
                                      out.data(), static_cast<unsigned int>(size));
  if (unpacked != size) refuse(source, "compressed points are damaged or cut off");
  return out;
}

/// Converts compressed data, field by field, to point by point.
std::vector<std::uint8_t> by_point(const PcdHeader& header, std::uint64_t point_bytes,
                                   std::string_view by_field) {
  std::vector<std::uint8_t> points(by_field.size());
  std::size_t from = 0;
  std::size_t offset = 0;
  for (const PcdField& field : header.fields) {
    for (std::uint64_t i = 0; i < *header.points; ++i) {
      std::memcpy(points.data() + i * point_bytes + offset, by_field.data() + from, field.size());
      from += field.size();
    }
    offset += field.size();
  }
  return points;
}

std::vector<std::uint8_t> points_of_ascii(const PcdHeader& header, std::string_view text,
                                          std::string_view source) {
  std::vector<TextField> fields;
  for (const PcdField& field : header.fields)
    fields.push_back({field.name, static_cast<FieldType>(field_type(field)), field.bytes,
                      field.count, field.name != kPadding});
  return points_of_text(fields, *header.points, text, source);
}

std::vector<std::uint8_t> points_of(const PcdHeader& header, std::uint64_t point_bytes,
                                    std::string_view data, std::string_view source) {
  const std::uint64_t size = *header.points * point_bytes;
  if (header.data == "ascii") return points_of_ascii(header, data, source);

  if (header.data == "binary") {
    if (data.size() < size) refuse(source, fmt::format("{} of {} bytes", data.size(), size));
    if (data.size() - size >= point_bytes)
      refuse(source, fmt::format("{} bytes behind the last of {} points", data.size() - size,
                                 *header.points));
    return {data.begin(), data.begin() + static_cast<std::ptrdiff_t>(size)};
  }

  if (header.data != "binary_compressed")
    refuse(source, fmt::format("DATA {} is not known", header.data));
  std::array<std::uint32_t, 2> sizes{};  // Packed and unpacked size.
  if (data.size() < sizeof sizes) refuse(source, "cut off");
  std::memcpy(sizes.data(), data.data(), sizeof sizes);
  if (sizes[1] != size || sizes[0] > data.size() - sizeof sizes)
    refuse(source,
           fmt::format("{} bytes for {} points of {}", sizes[1], *header.points, point_bytes));
  return by_point(header, point_bytes,
                  unpack_lzf(data.substr(sizeof sizes, sizes[0]), size, source));
}

}  // namespace

CloudFile parse_pcd(std::string_view bytes, std::string_view source) {
  const PcdHeader header = parse_header(bytes, source);
  CloudFile file;
  file.viewpoint = header.viewpoint;
  for (const PcdField& field : header.fields) {
    if (field.name != kPadding)
      file.cloud.fields.push_back(
          {field.name, file.cloud.point_step, field_type(field), field.count});
    file.cloud.point_step += field.size();
  }

  file.points = points_of(header, file.cloud.point_step, bytes.substr(header.end), source);
  file.cloud.height = static_cast<std::uint32_t>(*header.height);
  file.cloud.width = static_cast<std::uint32_t>(*header.width);
  file.cloud.row_step = file.cloud.width * file.cloud.point_step;
  file.cloud.data = file.points;
  return file;
}

}  // namespace understory::bag
