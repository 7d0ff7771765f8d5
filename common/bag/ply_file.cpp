#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <sstream>

#include "common/bag/cloud_fields.hpp"
#include "common/bag/cloud_file.hpp"
#include "common/bag/text_points.hpp"
#include "common/io/data_error.hpp"
#include "common/io/kitti_raw.hpp"

namespace understory::bag {
namespace {

constexpr std::uint64_t kMostVertices = 20'000'000;

struct PlyHeader {
  std::string format;
  std::uint64_t vertices = 0;
  std::vector<TextField> fields;
  std::size_t end = 0;  ///< Offset of the first vertex.
};

[[noreturn]] void refuse_ply(std::string_view source, const std::string& what) {
  throw io::DataError(fmt::format("{}: {}", source, what));
}

TextField vertex_field(const std::string& type, std::string name, std::string_view source) {
  struct Known {
    std::string_view name, other;
    FieldType type;
    std::uint32_t bytes;
  };
  static constexpr std::array<Known, 8> kKnown{{{"char", "int8", FieldType::kInt8, 1},
                                                {"uchar", "uint8", FieldType::kUint8, 1},
                                                {"short", "int16", FieldType::kInt16, 2},
                                                {"ushort", "uint16", FieldType::kUint16, 2},
                                                {"int", "int32", FieldType::kInt32, 4},
                                                {"uint", "uint32", FieldType::kUint32, 4},
                                                {"float", "float32", FieldType::kFloat32, 4},
                                                {"double", "float64", FieldType::kFloat64, 8}}};

  constexpr std::string_view kCloudCompare = "scalar_";
  std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::tolower(c); });
  if (name.starts_with(kCloudCompare)) name.erase(0, kCloudCompare.size());

  for (const Known& known : kKnown) {
    if (type == known.name || type == known.other) return {name, known.type, known.bytes};
  }
  refuse_ply(source, fmt::format("property {} of a vertex has type {}", name, type));
}

/// Reads the lines up to end_header. Only the first element is used: it must be the vertices, or
/// the file is refused.
PlyHeader parse_ply_header(std::string_view bytes, std::string_view source) {
  if (!bytes.starts_with("ply")) refuse_ply(source, "no PLY file");
  PlyHeader header;
  std::size_t elements = 0;
  std::size_t at = 0;
  while (at < bytes.size()) {
    const std::size_t end = std::min(bytes.find('\n', at), bytes.size());
    std::istringstream line{std::string(bytes.substr(at, std::min<std::size_t>(end - at, 1000)))};
    at = end + 1;
    std::string key;
    std::string first;
    std::string second;
    line >> key >> first >> second;

    if (key == "format") header.format = first;
    if (key == "element" && ++elements == 1) {
      const auto read =
          std::from_chars(second.data(), second.data() + second.size(), header.vertices);
      if (first != "vertex" || second.empty() || read.ec != std::errc{})
        refuse_ply(source, fmt::format("element {} {}: vertices are wanted first", first, second));
    }
    if (key == "property" && elements == 1)
      header.fields.push_back(vertex_field(first, second, source));
    if (key != "end_header") continue;

    header.end = std::min(at, bytes.size());
    if (header.fields.empty() || header.fields.size() > 256)
      refuse_ply(source, "no properties of vertices that could be");
    if (header.vertices > kMostVertices)
      refuse_ply(source, fmt::format("{} points, more than the {} that are read", header.vertices,
                                     kMostVertices));
    return header;
  }
  refuse_ply(source, "no line end_header");
}

/// A cloud without rows.
CloudFile unordered(std::span<const TextField> fields, std::uint64_t points) {
  CloudFile file;
  for (const TextField& field : fields) {
    file.cloud.fields.push_back(
        {field.name, file.cloud.point_step, static_cast<std::uint8_t>(field.type), 1});
    file.cloud.point_step += field.bytes;
  }
  file.cloud.height = 1;
  file.cloud.width = static_cast<std::uint32_t>(points);
  file.cloud.row_step = file.cloud.width * file.cloud.point_step;
  return file;
}

}  // namespace

CloudFile parse_ply(std::string_view bytes, std::string_view source) {
  const PlyHeader header = parse_ply_header(bytes, source);
  const std::string_view data = bytes.substr(header.end);
  CloudFile file = unordered(header.fields, header.vertices);
  const std::uint64_t size = header.vertices * file.cloud.point_step;
  file.cloud.is_big_endian = header.format == "binary_big_endian";

  if (header.format == "ascii") {
    file.points = points_of_text(header.fields, header.vertices, data, source);
  } else if (file.cloud.is_big_endian || header.format == "binary_little_endian") {
    if (data.size() < size) refuse_ply(source, fmt::format("{} of {} bytes", data.size(), size));
    file.points.assign(data.begin(), data.begin() + static_cast<std::ptrdiff_t>(size));
  } else {
    refuse_ply(source, fmt::format("format {} is not known", header.format));
  }
  file.cloud.data = file.points;
  return file;
}

CloudFile parse_kitti_bin(std::string_view bytes, std::string_view source) {
  const std::array<TextField, 4> fields{TextField{"x"}, TextField{"y"}, TextField{"z"},
                                        TextField{"intensity"}};
  CloudFile file = unordered(fields, io::kitti::points_in(bytes, source));
  file.points.assign(bytes.begin(), bytes.end());
  file.cloud.data = file.points;
  return file;
}

CloudFile parse_cloud_file(std::string_view bytes, const std::filesystem::path& file) {
  const std::string extension = file.extension().string();
  if (file.string().ends_with(".pcd.bin"))
    refuse_ply(file.string(), "five numbers a point (nuScenes) are not read");
  if (extension == ".ply") return parse_ply(bytes, file.string());
  if (extension == ".bin") return parse_kitti_bin(bytes, file.string());
  return parse_pcd(bytes, file.string());
}

}  // namespace understory::bag
