#include "deploy/cli/geojson_geometry.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace understory::cli {
namespace {

using Json = nlohmann::ordered_json;
constexpr double kDateLine_deg = 180.0;

Json place_json(const Eigen::Vector2d& place_deg) {
  const auto rounded = [](double degrees) { return std::round(degrees * 1e9) / 1e9; };
  return {rounded(place_deg.x()), rounded(place_deg.y())};
}

Json geometry_json(const char* type, Json coordinates) {
  return {{"type", type}, {"coordinates", std::move(coordinates)}};
}

/// Converts to longitudes from 0 to 360, which are continuous at the date line.
PlacesDeg counted_eastwards(PlacesDeg places) {
  for (Eigen::Vector2d& place : places)
    if (place.x() < 0.0) place.x() += 2.0 * kDateLine_deg;
  return places;
}

bool crosses_date_line(const PlacesDeg& places) {
  const auto [west, east] = std::ranges::minmax(places, {}, [](const auto& p) { return p.x(); });
  return east.x() - west.x() > kDateLine_deg;
}

Eigen::Vector2d on_date_line(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const double part = (kDateLine_deg - a.x()) / (b.x() - a.x());
  return {kDateLine_deg, a.y() + part * (b.y() - a.y())};
}

/// The date line has longitude 180 on its west side, -180 on its east side.
Json on_side(const PlacesDeg& places, bool is_west) {
  Json list = Json::array();
  for (Eigen::Vector2d place : places) {
    if (!is_west) place.x() -= 2.0 * kDateLine_deg;
    list.push_back(place_json(place));
  }
  return list;
}

/// The part of a ring on one side (Sutherland-Hodgman clipping with one line).
PlacesDeg part_of_ring(const PlacesDeg& ring, bool is_west) {
  const auto is_inside = [&](const Eigen::Vector2d& p) {
    return (p.x() <= kDateLine_deg) == is_west;
  };
  PlacesDeg part;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Eigen::Vector2d& a = ring[i];
    const Eigen::Vector2d& b = ring[(i + 1) % ring.size()];
    if (is_inside(a)) part.push_back(a);
    if (is_inside(a) != is_inside(b)) part.push_back(on_date_line(a, b));
  }
  return part;
}

Json closed_ring(Json ring) {
  ring.push_back(ring.front());
  return Json::array({std::move(ring)});
}

}  // namespace

Json point_geometry(const Eigen::Vector2d& place_deg) {
  return geometry_json("Point", place_json(place_deg));
}

Json line_geometry(const PlacesDeg& places) {
  if (!crosses_date_line(places)) return geometry_json("LineString", on_side(places, true));
  const PlacesDeg line = counted_eastwards(places);
  Json pieces = Json::array();
  PlacesDeg piece;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const bool is_west = line[i].x() <= kDateLine_deg;
    piece.push_back(line[i]);
    if (i + 1 == line.size()) {
      pieces.push_back(on_side(piece, is_west));
    } else if ((line[i + 1].x() <= kDateLine_deg) != is_west) {
      piece.push_back(on_date_line(line[i], line[i + 1]));
      pieces.push_back(on_side(piece, is_west));
      piece = {piece.back()};
    }
  }
  return geometry_json("MultiLineString", std::move(pieces));
}

Json polygon_geometry(const PlacesDeg& corners) {
  if (!crosses_date_line(corners))
    return geometry_json("Polygon", closed_ring(on_side(corners, true)));
  const PlacesDeg ring = counted_eastwards(corners);
  Json parts = Json::array();
  for (const bool is_west : {true, false})
    parts.push_back(closed_ring(on_side(part_of_ring(ring, is_west), is_west)));
  return geometry_json("MultiPolygon", std::move(parts));
}

}  // namespace understory::cli
