// The border of submap_codec.hpp.
#include <algorithm>
#include <boost/geometry/algorithms/convex_hull.hpp>
#include <boost/geometry/geometries/multi_point.hpp>
#include <boost/geometry/geometries/point_xy.hpp>
#include <boost/geometry/geometries/polygon.hpp>
#include <boost/geometry/strategies/strategies.hpp>

#include "common/map_file/submap_codec.hpp"

namespace understory::map_file {
namespace {

namespace bg = boost::geometry;
using HullPoint = bg::model::d2::point_xy<double>;

constexpr double kMargin_m = 0.5;

}  // namespace

std::vector<Eigen::Vector2d> border_around(std::span<const Eigen::Vector2d> places_m) {
  // Use the corners of a square around each position, so that the hull of few or collinear
  // positions is a polygon.
  bg::model::multi_point<HullPoint> points;
  points.reserve(4 * places_m.size());
  for (const Eigen::Vector2d& place : places_m) {
    for (const double dx : {-kMargin_m, kMargin_m}) {
      for (const double dy : {-kMargin_m, kMargin_m})
        points.push_back(HullPoint(place.x() + dx, place.y() + dy));
    }
  }
  bg::model::polygon<HullPoint> hull;
  bg::convex_hull(points, hull);

  std::vector<Eigen::Vector2d> corners;
  corners.reserve(hull.outer().size());
  for (const HullPoint& point : hull.outer()) corners.emplace_back(point.x(), point.y());
  // Boost repeats the first corner.
  if (corners.size() > 1) corners.pop_back();
  std::reverse(corners.begin(), corners.end());
  return corners;
}

}  // namespace understory::map_file
