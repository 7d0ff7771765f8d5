#include "common/foxglove/schemas.hpp"

#include "common/foxglove/json_text.hpp"

namespace understory::foxglove {
namespace {

using Properties = std::vector<Property>;

const std::string kNumber = R"({"type":"number"})";
const std::string kText = R"({"type":"string"})";
const std::string kFlag = R"({"type":"boolean"})";
const std::string kCount = R"({"type":"integer","minimum":0})";
const std::string kBytes = R"({"type":"string","contentEncoding":"base64"})";

std::string list_of(std::string_view items) {
  return R"({"type":"array","items":)" + std::string(items) + "}";
}

/// An enumeration: names of the values from 0.
std::string choice(std::string_view title, const std::vector<std::string_view>& names) {
  JsonText out;
  out.begin_object();
  out.field("title", title);
  out.key("oneOf");
  out.begin_array();
  for (std::size_t i = 0; i < names.size(); ++i) {
    out.begin_object();
    out.field("title", names[i]);
    out.field("const", i);
    out.end_object();
  }
  out.end_array();
  out.end_object();
  return out.take();
}

std::string duration_schema() {
  return R"({"type":"object","title":"duration","properties":{"sec":{"type":"integer"},)"
         R"("nsec":{"type":"integer","minimum":0,"maximum":999999999}}})";
}

std::string coordinates(std::string_view title) {
  return object_schema(title, {{"x", kNumber}, {"y", kNumber}, {"z", kNumber}});
}

std::string vector3() { return coordinates("foxglove.Vector3"); }

std::string quaternion() {
  return object_schema("foxglove.Quaternion",
                       {{"x", kNumber}, {"y", kNumber}, {"z", kNumber}, {"w", kNumber}});
}

std::string pose() {
  return object_schema("foxglove.Pose", {{"position", vector3()}, {"orientation", quaternion()}});
}

std::string color() {
  return object_schema("foxglove.Color",
                       {{"r", kNumber}, {"g", kNumber}, {"b", kNumber}, {"a", kNumber}});
}

std::string key_values() {
  return list_of(
      object_schema("foxglove.KeyValuePair", Properties{{"key", kText}, {"value", kText}}));
}

std::string transform() {
  return object_schema("foxglove.FrameTransform", {{"timestamp", time_schema()},
                                                   {"parent_frame_id", kText},
                                                   {"child_frame_id", kText},
                                                   {"translation", vector3()},
                                                   {"rotation", quaternion()}});
}

std::string points() { return list_of(coordinates("foxglove.Point3")); }

std::string solid(std::string_view title) {
  return object_schema(title, {{"pose", pose()}, {"size", vector3()}, {"color", color()}});
}

std::string arrow() {
  return object_schema("foxglove.ArrowPrimitive", {{"pose", pose()},
                                                   {"shaft_length", kNumber},
                                                   {"shaft_diameter", kNumber},
                                                   {"head_length", kNumber},
                                                   {"head_diameter", kNumber},
                                                   {"color", color()}});
}

std::string cylinder() {
  return object_schema("foxglove.CylinderPrimitive", {{"pose", pose()},
                                                      {"size", vector3()},
                                                      {"bottom_scale", kNumber},
                                                      {"top_scale", kNumber},
                                                      {"color", color()}});
}

std::string line() {
  return object_schema(
      "foxglove.LinePrimitive",
      {{"type", choice("foxglove.LineType", {"LINE_STRIP", "LINE_LOOP", "LINE_LIST"})},
       {"pose", pose()},
       {"thickness", kNumber},
       {"scale_invariant", kFlag},
       {"points", points()},
       {"color", color()},
       {"colors", list_of(color())},
       {"indices", list_of(kCount)}});
}

std::string triangles() {
  return object_schema("foxglove.TriangleListPrimitive", {{"pose", pose()},
                                                          {"points", points()},
                                                          {"color", color()},
                                                          {"colors", list_of(color())},
                                                          {"indices", list_of(kCount)}});
}

std::string label() {
  return object_schema("foxglove.TextPrimitive", {{"pose", pose()},
                                                  {"billboard", kFlag},
                                                  {"font_size", kNumber},
                                                  {"scale_invariant", kFlag},
                                                  {"color", color()},
                                                  {"text", kText}});
}

std::string model() {
  return object_schema("foxglove.ModelPrimitive", {{"pose", pose()},
                                                   {"scale", vector3()},
                                                   {"color", color()},
                                                   {"override_color", kFlag},
                                                   {"url", kText},
                                                   {"media_type", kText},
                                                   {"data", kBytes}});
}

std::string entity() {
  return object_schema("foxglove.SceneEntity",
                       {{"timestamp", time_schema()},
                        {"frame_id", kText},
                        {"id", kText},
                        {"lifetime", duration_schema()},
                        {"frame_locked", kFlag},
                        {"metadata", key_values()},
                        {"arrows", list_of(arrow())},
                        {"cubes", list_of(solid("foxglove.CubePrimitive"))},
                        {"spheres", list_of(solid("foxglove.SpherePrimitive"))},
                        {"cylinders", list_of(cylinder())},
                        {"lines", list_of(line())},
                        {"triangles", list_of(triangles())},
                        {"texts", list_of(label())},
                        {"models", list_of(model())}});
}

std::string scene_update() {
  const std::string deletion =
      object_schema("foxglove.SceneEntityDeletion",
                    {{"timestamp", time_schema()},
                     {"type", choice("foxglove.SceneEntityDeletionType", {"MATCHING_ID", "ALL"})},
                     {"id", kText}});
  return object_schema("foxglove.SceneUpdate",
                       {{"deletions", list_of(deletion)}, {"entities", list_of(entity())}});
}

std::string point_cloud() {
  const std::string field = object_schema(
      "foxglove.PackedElementField",
      {{"name", kText},
       {"offset", kCount},
       {"type", choice("foxglove.NumericType", {"UNKNOWN", "UINT8", "INT8", "UINT16", "INT16",
                                                "UINT32", "INT32", "FLOAT32", "FLOAT64"})}});
  return object_schema("foxglove.PointCloud", {{"timestamp", time_schema()},
                                               {"frame_id", kText},
                                               {"pose", pose()},
                                               {"point_stride", kCount},
                                               {"fields", list_of(field)},
                                               {"data", kBytes}});
}

std::string laser_scan() {
  return object_schema("foxglove.LaserScan", {{"timestamp", time_schema()},
                                              {"frame_id", kText},
                                              {"pose", pose()},
                                              {"start_angle", kNumber},
                                              {"end_angle", kNumber},
                                              {"ranges", list_of(kNumber)},
                                              {"intensities", list_of(kNumber)}});
}

std::string log() {
  const std::string level =
      choice("foxglove.LogLevel", {"UNKNOWN", "DEBUG", "INFO", "WARNING", "ERROR", "FATAL"});
  return object_schema("foxglove.Log", {{"timestamp", time_schema()},
                                        {"level", level},
                                        {"message", kText},
                                        {"name", kText},
                                        {"file", kText},
                                        {"line", kCount}});
}

std::string location_fix() {
  const std::string covariance =
      R"({"type":"array","items":{"type":"number"},"minItems":9,"maxItems":9})";
  const std::string kind = choice("foxglove.PositionCovarianceType",
                                  {"UNKNOWN", "APPROXIMATED", "DIAGONAL_KNOWN", "KNOWN"});
  return object_schema("foxglove.LocationFix", {{"timestamp", time_schema()},
                                                {"frame_id", kText},
                                                {"latitude", kNumber},
                                                {"longitude", kNumber},
                                                {"altitude", kNumber},
                                                {"position_covariance", covariance},
                                                {"position_covariance_type", kind},
                                                {"heading", kNumber, false},
                                                {"velocity", vector3(), false},
                                                {"color", color(), false},
                                                {"metadata", key_values(), false}});
}

std::string in_frame(std::string_view title, const Property& content) {
  return object_schema(title, {{"timestamp", time_schema()}, {"frame_id", kText}, content});
}

}  // namespace

std::string object_schema(std::string_view title, const std::vector<Property>& properties) {
  JsonText out;
  out.begin_object();
  out.field("title", title);
  out.field("type", "object");
  out.key("properties");
  out.begin_object();
  for (const Property& property : properties) {
    out.key(property.name);
    out.raw(property.schema);
  }
  out.end_object();

  out.key("required");
  out.begin_array();
  for (const Property& property : properties) {
    if (property.is_required) out.value(property.name);
  }
  out.end_array();
  out.end_object();
  return out.take();
}

std::string time_schema() {
  return R"({"type":"object","title":"time","properties":{"sec":{"type":"integer","minimum":0},)"
         R"("nsec":{"type":"integer","minimum":0,"maximum":999999999}}})";
}

std::map<std::string_view, std::string> well_known_schemas() {
  return {{"foxglove.FrameTransforms",
           object_schema("foxglove.FrameTransforms", {{"transforms", list_of(transform())}})},
          {"foxglove.PoseInFrame", in_frame("foxglove.PoseInFrame", {"pose", pose()})},
          {"foxglove.PosesInFrame", in_frame("foxglove.PosesInFrame", {"poses", list_of(pose())})},
          {"foxglove.SceneUpdate", scene_update()},
          {"foxglove.LaserScan", laser_scan()},
          {"foxglove.PointCloud", point_cloud()},
          {"foxglove.Log", log()},
          {"foxglove.LocationFix", location_fix()}};
}

}  // namespace understory::foxglove
