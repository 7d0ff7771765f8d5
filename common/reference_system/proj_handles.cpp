#include "common/reference_system/proj_handles.hpp"

#include <fmt/format.h>

#include <cmath>
#include <string_view>

#include "common/reference_system/reference_system.hpp"

namespace understory::reference_system {
namespace {

constexpr std::size_t kLongestShown = 60;

[[noreturn]] void refuse_system(const std::string& text, const std::string& why) {
  throw ReferenceError(fmt::format("{}: {}", text.substr(0, kLongestShown), why));
}

const char* kind_text(PJ_TYPE type) {
  switch (type) {
    case PJ_TYPE_GEOCENTRIC_CRS:
      return "is geocentric (X, Y, Z from the earth's centre); a map needs a projected or a "
             "geographic system";
    case PJ_TYPE_VERTICAL_CRS:
      return "is a system of heights; a map needs a horizontal one";
    case PJ_TYPE_GEOGRAPHIC_3D_CRS:
      return "has heights; name the system of latitude and longitude alone";
    case PJ_TYPE_ENGINEERING_CRS:
      return "is an engineering system: nothing says where it lies on the earth";
    case PJ_TYPE_BOUND_CRS:
      return "is bound to a transformation; name the system itself";
    default:
      return "is neither a projected nor a geographic system";
  }
}

/// The horizontal part of the system that the user named.
ProjHandle horizontal_part(PJ_CONTEXT* context, ProjHandle found, const std::string& text) {
  PJ_TYPE type = proj_get_type(found.get());
  if (type == PJ_TYPE_COMPOUND_CRS) {
    found.reset(proj_crs_get_sub_crs(context, found.get(), 0));
    if (!found) refuse_system(text, "has no horizontal part");
    type = proj_get_type(found.get());
  }
  if (type != PJ_TYPE_PROJECTED_CRS && type != PJ_TYPE_GEOGRAPHIC_2D_CRS)
    refuse_system(text, kind_text(type));
  return found;
}

std::string axis_direction(PJ_CONTEXT* context, PJ* axes, int axis) {
  const char* direction = "";
  proj_cs_get_axis_info(context, axes, axis, nullptr, nullptr, &direction, nullptr, nullptr,
                        nullptr, nullptr);
  return direction;
}

void require_east_and_north(PJ_CONTEXT* context, PJ* system, const std::string& text) {
  const ProjHandle axes(proj_crs_get_coordinate_system(context, system));
  const std::string first = axes ? axis_direction(context, axes.get(), 0) : "";
  const std::string second = axes ? axis_direction(context, axes.get(), 1) : "";
  const bool is_usual =
      (first == "east" && second == "north") || (first == "north" && second == "east");
  if (!is_usual)
    refuse_system(text,
                  fmt::format("its axes point {} and {}; east and north are read", first, second));
}

bool is_number(std::string_view text) {
  return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
}

}  // namespace

ContextHandle new_context() {
  ContextHandle context(proj_context_create());
  if (!context) throw ReferenceError("the library PROJ does not start");
  proj_log_level(context.get(), PJ_LOG_NONE);
  proj_context_set_enable_network(context.get(), 0);
  return context;
}

ProjHandle horizontal_system(PJ_CONTEXT* context, const std::string& text) {
  if (proj_context_get_database_metadata(context, "EPSG.VERSION") == nullptr)
    refuse_system(text, "PROJ's database of reference systems (proj-data) is not installed");
  if (is_number(text)) refuse_system(text, fmt::format("write EPSG:{}", text));
  ProjHandle found(proj_create(context, text.c_str()));
  if (!found || proj_is_crs(found.get()) == 0)
    refuse_system(text, "no reference system of this name is known (e.g. EPSG:25832)");
  found = horizontal_part(context, std::move(found), text);
  require_east_and_north(context, found.get(), text);
  return found;
}

std::string code_of(PJ* system) {
  const char* const registry = proj_get_id_auth_name(system, 0);
  const char* const code = proj_get_id_code(system, 0);
  if (registry != nullptr && code != nullptr) return fmt::format("{}:{}", registry, code);
  const char* const name = proj_get_name(system);
  return name == nullptr ? "" : name;
}

ProjHandle operation_between(PJ_CONTEXT* context, PJ* from, PJ* to, PJ_AREA* area) {
  const ProjHandle as_stated(proj_create_crs_to_crs_from_pj(context, from, to, area, nullptr));
  ProjHandle operation;
  if (as_stated) operation.reset(proj_normalize_for_visualization(context, as_stated.get()));
  if (!operation)
    throw ReferenceError(
        fmt::format("no transformation from {} to {} is known", code_of(from), code_of(to)));
  return operation;
}

Eigen::Vector2d passed(PJ* operation, PJ_DIRECTION direction, const Eigen::Vector2d& at) {
  proj_errno_reset(operation);
  const PJ_COORD result =
      proj_trans(operation, direction, proj_coord(at.x(), at.y(), 0.0, HUGE_VAL));
  const Eigen::Vector2d there(result.xy.x, result.xy.y);
  if (proj_errno(operation) != 0 || !there.allFinite())
    throw ReferenceError(
        fmt::format("the coordinates {:.10g}, {:.10g} are outside of what the reference system has",
                    at.x(), at.y()));
  return there;
}

}  // namespace understory::reference_system
