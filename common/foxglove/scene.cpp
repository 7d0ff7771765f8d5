#include "common/foxglove/scene.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace understory::foxglove {
namespace {

constexpr double kHeight_m = 2.0;
constexpr double kUnknownRadius_m = 0.15;

double hundredths(double value) { return std::round(value * 1e2) / 1e2; }
/// For unit quaternions: 1e-6 is 2e-6 rad.
double millionths(double value) { return std::round(value * 1e6) / 1e6; }

}  // namespace

std::string submap_frame(std::uint64_t submap_id) { return fmt::format("submap_{}", submap_id); }

std::uint64_t nanoseconds(model::Utime utime) {
  constexpr model::Utime kLatest = std::numeric_limits<std::int64_t>::max() / 1000;
  return static_cast<std::uint64_t>(std::clamp<model::Utime>(utime, 0, kLatest)) * 1000U;
}

void time_field(JsonText& out, std::string_view name, model::Utime utime) {
  const std::uint64_t ns = nanoseconds(utime);
  out.key(name);
  out.begin_object();
  out.field("sec", ns / 1'000'000'000U);
  out.field("nsec", ns % 1'000'000'000U);
  out.end_object();
}

void vector_field(JsonText& out, std::string_view name, const Eigen::Vector3d& value) {
  out.key(name);
  out.begin_object();
  out.field("x", rounded(value.x()));
  out.field("y", rounded(value.y()));
  out.field("z", rounded(value.z()));
  out.end_object();
}

void quaternion_field(JsonText& out, std::string_view name, const Eigen::Quaterniond& value) {
  out.key(name);
  out.begin_object();
  out.field("x", millionths(value.x()));
  out.field("y", millionths(value.y()));
  out.field("z", millionths(value.z()));
  out.field("w", millionths(value.w()));
  out.end_object();
}

void pose_value(JsonText& out, const geometry::SE2& pose) {
  const double half = 0.5 * pose.theta();
  out.begin_object();
  vector_field(out, "position", {pose.x(), pose.y(), 0.0});
  quaternion_field(out, "orientation", {std::cos(half), 0.0, 0.0, std::sin(half)});
  out.end_object();
}

void place_field(JsonText& out, const Eigen::Vector3d& position) {
  out.key("pose");
  out.begin_object();
  vector_field(out, "position", position);
  quaternion_field(out, "orientation", Eigen::Quaterniond::Identity());
  out.end_object();
}

void color_field(JsonText& out, const Color& color) {
  out.key("color");
  out.begin_object();
  out.field("r", hundredths(color.red));
  out.field("g", hundredths(color.green));
  out.field("b", hundredths(color.blue));
  out.field("a", hundredths(color.alpha));
  out.end_object();
}

Color existence_color(double probability, bool is_in_use) {
  const double alpha = is_in_use ? 1.0 : 0.25;
  if (std::isnan(probability)) return {0.6, 0.6, 0.6, alpha};
  return {std::min(1.0, 2.0 * (1.0 - probability)), std::min(0.8, 1.6 * probability), 0.1, alpha};
}

void internal::begin_entity(JsonText& out, model::Utime utime, std::string_view frame,
                            std::string_view id) {
  out.begin_object();
  time_field(out, "timestamp", utime);
  out.field("frame_id", frame);
  out.field("id", id);
  time_field(out, "lifetime", 0);
  out.field("frame_locked", true);
}

void internal::landmark_value(JsonText& out, const DrawnLandmark& landmark) {
  const double radius_m = landmark.radius_m > 0.0 ? landmark.radius_m : kUnknownRadius_m;
  out.begin_object();
  place_field(out, {landmark.position_m.x(), landmark.position_m.y(), 0.5 * kHeight_m});
  vector_field(out, "size", {2.0 * radius_m, 2.0 * radius_m, kHeight_m});
  if (landmark.kind == model::LandmarkKind::kTrunk) {
    out.field("bottom_scale", 1);
    out.field("top_scale", 1);
  }
  color_field(out, landmark.color);
  out.end_object();
}

void internal::end_entity(JsonText& out) {
  for (const auto* const field :
       {"metadata", "arrows", "spheres", "lines", "triangles", "texts", "models"}) {
    out.key(field);
    out.raw("[]");
  }
  out.end_object();
}

}  // namespace understory::foxglove
