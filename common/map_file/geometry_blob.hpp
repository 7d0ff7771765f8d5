// Geometries in a GeoPackage's format: a header, then well-known binary (OGC 12-128, 2.1.3).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace understory::map_file {

/// The number of the spatial reference system "undefined Cartesian": metres in a frame of our own.
inline constexpr std::int32_t kCartesian = -1;
/// The number of the reference system that locates the maps' frame on the earth
/// (reference_rows.hpp).
inline constexpr std::int32_t kMapFrame = 990001;

/// Kinds of geometry in the layers, with their numbers in well-known binary.
enum class GeometryKind : std::uint32_t { kPoint = 1, kLine = 2, kPolygon = 3 };

/// A point, a line, or the single ring of a polygon, without repeating the first corner.
struct Geometry {
  GeometryKind kind = GeometryKind::kPoint;
  std::vector<Eigen::Vector2d> points_m;  ///< At least one; frame `map`.
};

/// The rectangle around a geometry [m].
struct Box {
  Eigen::Vector2d low_m = Eigen::Vector2d::Zero();
  Eigen::Vector2d high_m = Eigen::Vector2d::Zero();
};

/// Encodes a geometry, little endian, with the number of its reference system, and with an envelope
/// unless it is a point.
std::vector<std::uint8_t> geometry_blob(const Geometry& geometry, std::int32_t srs_id = kCartesian);
/// The same for a point.
std::vector<std::uint8_t> point_blob(const Eigen::Vector2d& position_m,
                                     std::int32_t srs_id = kCartesian);

/// Decodes a geometry of either byte order and any reference system. None where it is damaged,
/// empty, of another kind or dimension, or a polygon with holes.
std::optional<Geometry> geometry_of(std::span<const std::uint8_t> blob);

/// Box around all points. Precondition: at least one.
Box box_of(const Geometry& geometry);

}  // namespace understory::map_file
