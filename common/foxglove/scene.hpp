// JSON of message parts that several schemas share.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <string_view>

#include "common/foxglove/json_text.hpp"
#include "common/geometry/se2.hpp"
#include "common/model/map.hpp"

namespace understory::foxglove {

/// Names of frames in messages.
inline constexpr std::string_view kMapFrame = "map";
/// The vehicle, in the plane of the map.
inline constexpr std::string_view kVehicleFrame = "vehicle";
/// Frame of a submap that was handed over.
std::string submap_frame(std::uint64_t submap_id);

/// `utime` [us] as nanoseconds since the epoch; earlier times become 0.
std::uint64_t nanoseconds(model::Utime utime);
/// Field `name`: {sec, nsec}.
void time_field(JsonText& out, std::string_view name, model::Utime utime);
/// Field `name`: a position [m].
void vector_field(JsonText& out, std::string_view name, const Eigen::Vector3d& value);
/// Field `name`: an orientation.
void quaternion_field(JsonText& out, std::string_view name, const Eigen::Quaterniond& value);
/// A pose in the plane, as a value.
void pose_value(JsonText& out, const geometry::SE2& pose);
/// Field `pose`: a position with zero rotation.
void place_field(JsonText& out, const Eigen::Vector3d& position);

/// Colour; each component 0 to 1.
struct Color {
  double red = 0.0;
  double green = 0.0;
  double blue = 0.0;
  double alpha = 1.0;
};
/// Field `color`.
void color_field(JsonText& out, const Color& color);
/// Red (removed) over yellow to green (existing); grey = unknown; faint = not in use.
Color existence_color(double probability, bool is_in_use);

/// One landmark as it is drawn: a trunk as a cylinder, a corner as a slender box.
struct DrawnLandmark {
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
  double radius_m = 0.0;  ///< 0 = unknown: drawn with 0.15 m.
  model::LandmarkKind kind = model::LandmarkKind::kTrunk;
  Color color;
};

/// One entity of a SceneUpdate; `landmarks` is a range of DrawnLandmark. Frame-locked: it moves
/// with its frame.
template <class Range>
void entity_value(JsonText& out, model::Utime utime, std::string_view frame, std::string_view id,
                  const Range& landmarks);

/// A SceneUpdate that deletes nothing, with one entity.
template <class Range>
std::string scene_of(model::Utime utime, std::string_view frame, std::string_view id,
                     const Range& landmarks);

/// Parts of the templates above.
namespace internal {
/// Everything of an entity before its landmarks.
void begin_entity(JsonText& out, model::Utime utime, std::string_view frame, std::string_view id);
/// A primitive of `cylinders` or `cubes`.
void landmark_value(JsonText& out, const DrawnLandmark& landmark);
/// Empty lists of the unused kinds of primitives.
void end_entity(JsonText& out);
}  // namespace internal

template <class Range>
void entity_value(JsonText& out, model::Utime utime, std::string_view frame, std::string_view id,
                  const Range& landmarks) {
  internal::begin_entity(out, utime, frame, id);
  for (const auto& [field, kind] : {std::pair{"cylinders", model::LandmarkKind::kTrunk},
                                    std::pair{"cubes", model::LandmarkKind::kCorner}}) {
    out.key(field);
    out.begin_array();
    for (const DrawnLandmark& landmark : landmarks) {
      if (landmark.kind == kind) internal::landmark_value(out, landmark);
    }
    out.end_array();
  }
  internal::end_entity(out);
}

template <class Range>
std::string scene_of(model::Utime utime, std::string_view frame, std::string_view id,
                     const Range& landmarks) {
  JsonText out;
  out.begin_object();
  out.key("deletions");
  out.raw("[]");
  out.key("entities");
  out.begin_array();
  entity_value(out, utime, frame, id, landmarks);
  out.end_array();
  out.end_object();
  return out.take();
}

}  // namespace understory::foxglove
