#include "common/reference_system/reference_system.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/reference_system/proj_handles.hpp"

namespace understory::reference_system {
namespace {

constexpr double kPerDegree = std::numbers::pi / 180.0;
constexpr const char* kWgs84Code = "EPSG:4326";
/// Digits of the origin's degrees: 0.01 mm.
constexpr double kOriginSteps = 1e10;
/// Azimuth of the oblique projection's line. Any angle that is not along an axis is possible.
constexpr double kAzimuthDeg = 45.0;
/// Half size of the area around the place that selects a transformation [deg].
constexpr double kAreaDeg = 0.01;

struct AreaRelease {
  void operator()(PJ_AREA* area) const { proj_area_destroy(area); }
};
using AreaHandle = std::unique_ptr<PJ_AREA, AreaRelease>;

AreaHandle area_around(const std::optional<Geographic>& near) {
  if (!near) return nullptr;
  AreaHandle area(proj_area_create());
  proj_area_set_bbox(area.get(), near->longitude_deg - kAreaDeg, near->latitude_deg - kAreaDeg,
                     near->longitude_deg + kAreaDeg, near->latitude_deg + kAreaDeg);
  return area;
}

/// Factor of a system's first axis: metres, or radians, for one unit.
double unit_of_axes(PJ_CONTEXT* context, PJ* system) {
  const ProjHandle axes(proj_crs_get_coordinate_system(context, system));
  double factor = 1.0;
  if (axes)
    proj_cs_get_axis_info(context, axes.get(), 0, nullptr, nullptr, nullptr, &factor, nullptr,
                          nullptr, nullptr);
  return factor;
}

bool is_geographic_type(PJ* system) { return proj_get_type(system) == PJ_TYPE_GEOGRAPHIC_2D_CRS; }

/// The prime meridian of a system [deg east of Greenwich].
double prime_meridian_deg(PJ_CONTEXT* context, PJ* geographic) {
  const ProjHandle meridian(proj_get_prime_meridian(context, geographic));
  double longitude = 0.0;
  double factor = kPerDegree;
  if (meridian)
    proj_prime_meridian_get_parameters(context, meridian.get(), &longitude, &factor, nullptr);
  return longitude * factor / kPerDegree;
}

double rounded_deg(double degrees) { return std::round(degrees * kOriginSteps) / kOriginSteps; }

struct FramePlace {
  double latitude_deg = 0.0;
  double longitude_deg = 0.0;  ///< Longitude from the datum's own meridian.
  double rotation_rad = 0.0;
};

/// Its projection as well-known text; angles are in the datum's units.
std::string projection_text(const FramePlace& place, double degrees_per_unit) {
  const auto angle = [&](double degrees) { return degrees / degrees_per_unit; };
  if (place.rotation_rad == 0.0)
    return fmt::format(
        R"(PROJECTION["Transverse_Mercator"],PARAMETER["latitude_of_origin",{:.16g}],)"
        R"(PARAMETER["central_meridian",{:.16g}])",
        angle(place.latitude_deg), angle(place.longitude_deg));
  return fmt::format(R"(PROJECTION["Hotine_Oblique_Mercator_Azimuth_Center"],)"
                     R"(PARAMETER["latitude_of_center",{:.16g}],)"
                     R"(PARAMETER["longitude_of_center",{:.16g}],PARAMETER["azimuth",{:.16g}],)"
                     R"(PARAMETER["rectified_grid_angle",{:.16g}])",
                     angle(place.latitude_deg), angle(place.longitude_deg), angle(kAzimuthDeg),
                     angle(kAzimuthDeg + place.rotation_rad / kPerDegree));
}

std::string definition_of_frame(PJ_CONTEXT* context, PJ* base, const FramePlace& place,
                                double degrees_per_unit) {
  static constexpr const char* kOptions[] = {"MULTILINE=NO", nullptr};
  const char* const datum = proj_as_wkt(context, base, PJ_WKT1_GDAL, kOptions);
  if (datum == nullptr)
    throw ReferenceError(fmt::format("{}: no local frame can be defined on it", code_of(base)));
  return fmt::format(
      R"(PROJCS["Understory map",{},{},PARAMETER["scale_factor",1],PARAMETER["false_easting",0],)"
      R"(PARAMETER["false_northing",0],UNIT["metre",1,AUTHORITY["EPSG","9001"]],)"
      R"(AXIS["Easting",EAST],AXIS["Northing",NORTH]])",
      datum, projection_text(place, degrees_per_unit));
}

/// Bounds of an area; west is above east if it crosses the date line.
struct Bounds {
  double west_deg = 0.0;
  double south_deg = 0.0;
  double east_deg = 0.0;
  double north_deg = 0.0;
};

/// Distance from longitude and latitude to the bounds on a sphere, along a parallel and a meridian;
/// 0 within them.
double distance_to(const Bounds& bounds, const Eigen::Vector2d& place_deg) {
  constexpr double kEarthRadius_m = 6.371e6;
  const auto turned = [](double degrees) { return degrees - 360.0 * std::floor(degrees / 360.0); };
  const double width_deg = bounds.east_deg >= bounds.west_deg
                               ? bounds.east_deg - bounds.west_deg
                               : bounds.east_deg + 360.0 - bounds.west_deg;
  const double from_west_deg = turned(place_deg.x() - bounds.west_deg);
  const double beside_deg =
      from_west_deg <= width_deg ? 0.0 : std::min(from_west_deg - width_deg, 360.0 - from_west_deg);
  const double above_deg =
      std::max({0.0, bounds.south_deg - place_deg.y(), place_deg.y() - bounds.north_deg});
  return kEarthRadius_m * kPerDegree *
         std::hypot(above_deg, beside_deg * std::cos(place_deg.y() * kPerDegree));
}

/// Approximate location of a frame's origin, sufficient to select a transformation.
Geographic place_of(const model::MapReference& frame) {
  return {frame.latitude_deg, frame.longitude_deg};
}

}  // namespace

struct Transformation::Parts {
  ContextHandle context = new_context();
  ProjHandle operation;
};

Transformation::Transformation(const std::string& from, const std::string& to,
                               const std::optional<Geographic>& near)
    : parts_(std::make_unique<Parts>()) {
  PJ_CONTEXT* const context = parts_->context.get();
  const ProjHandle first = horizontal_system(context, from);
  const ProjHandle second = horizontal_system(context, to);
  const AreaHandle area = area_around(near);
  parts_->operation = operation_between(context, first.get(), second.get(), area.get());
}

Transformation::~Transformation() = default;
Transformation::Transformation(Transformation&&) noexcept = default;

Eigen::Vector2d Transformation::forward(const Eigen::Vector2d& from) const {
  return passed(parts_->operation.get(), PJ_FWD, from);
}

Eigen::Vector2d Transformation::inverse(const Eigen::Vector2d& to) const {
  return passed(parts_->operation.get(), PJ_INV, to);
}

std::optional<double> Transformation::accuracy_m() const {
  const PJ_PROJ_INFO info = proj_pj_info(parts_->operation.get());
  return info.accuracy < 0.0 ? std::nullopt : std::optional(info.accuracy);
}

SystemSummary summary_of(const std::string& system) {
  const ContextHandle context = new_context();
  const ProjHandle found = horizontal_system(context.get(), system);
  SystemSummary summary;
  summary.code = code_of(found.get());
  summary.name = proj_get_name(found.get());
  summary.is_geographic = is_geographic_type(found.get());
  summary.unit = unit_of_axes(context.get(), found.get());
  if (summary.is_geographic) summary.unit /= kPerDegree;
  return summary;
}

model::MapReference frame_at(const std::string& system, const Eigen::Vector2d& origin,
                             double rotation_rad) {
  const ContextHandle context = new_context();
  const ProjHandle found = horizontal_system(context.get(), system);
  const ProjHandle base(proj_crs_get_geodetic_crs(context.get(), found.get()));
  const ProjHandle to_base = operation_between(context.get(), found.get(), base.get(), nullptr);
  const double degrees_per_unit = unit_of_axes(context.get(), base.get()) / kPerDegree;
  const Eigen::Vector2d at_deg = degrees_per_unit * passed(to_base.get(), PJ_FWD, origin);
  if (std::abs(at_deg.y()) > 89.0)
    throw ReferenceError(fmt::format("{}: the origin is within a degree of a pole", system));

  model::MapReference frame;
  frame.system = code_of(found.get());
  frame.latitude_deg = rounded_deg(at_deg.y());
  // A table across the date line may continue beyond 180 degrees.
  const double longitude_deg = rounded_deg(std::remainder(at_deg.x(), 360.0));
  frame.longitude_deg = longitude_deg + prime_meridian_deg(context.get(), base.get());
  frame.rotation_rad = rotation_rad;
  frame.definition =
      definition_of_frame(context.get(), base.get(),
                          {frame.latitude_deg, longitude_deg, rotation_rad}, degrees_per_unit);
  return frame;
}

Transformation into_frame(const std::string& system, const model::MapReference& frame) {
  return {system, frame.definition, place_of(frame)};
}

Transformation to_wgs84(const model::MapReference& frame) {
  return {frame.definition, kWgs84Code, place_of(frame)};
}

std::optional<OutsideArea> outside_area(const std::string& system, const Eigen::Vector2d& at) {
  const ContextHandle context = new_context();
  const ProjHandle found = horizontal_system(context.get(), system);
  Bounds bounds;
  const char* name = nullptr;
  const bool is_known =
      proj_get_area_of_use(context.get(), found.get(), &bounds.west_deg, &bounds.south_deg,
                           &bounds.east_deg, &bounds.north_deg, &name) != 0;
  if (!is_known) return std::nullopt;

  const Eigen::Vector2d place = Transformation(system, kWgs84Code).forward(at);
  const double distance_m = distance_to(bounds, place);
  if (distance_m <= 0.0) return std::nullopt;
  return OutsideArea{
      distance_m,
      fmt::format("latitude {:.4f}, longitude {:.4f} is {:.0f} km outside of the area of {} ({}): "
                  "are the columns swapped, or is it another system?",
                  place.y(), place.x(), std::ceil(1e-3 * distance_m), code_of(found.get()),
                  name == nullptr ? "unnamed" : name)};
}

}  // namespace understory::reference_system
